// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "document/writers.h"
#include "image/image_file.h"
#include "image/spectral_image.h"
#include "support/chromium.h"
#include "support/scratch.h"

namespace truebox {
namespace {

using testing::HasSubstr;

constexpr int kWidth = 40, kHeight = 30;
constexpr const char* kHostile = "</script><img src=x onerror=\"hacked = 1\"> & 'name'";

/// Values that tell every pixel and band from every other: a reading of the wrong one is noticed.
Image measured(double factor) {
  Image image(kWidth, kHeight);
  image.attributes["unit"] = "W m^-2 sr^-1 nm^-1";
  for (int b = 0; b < 3; ++b) {
    Channel& channel = image.add_channel(spectral_channel_name(450.0 + 100.0 * b));
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        channel.samples[image.index(x, y)] =
            static_cast<float>(factor * (0.1 + 0.01 * x + 0.003 * y) * (1.0 + b));
  }
  return image;
}

/// The pair as a user has it: written to EXR and read again.
struct Pair {
  Image test, reference, u;
  Pair() {
    Image t = measured(1.02);
    for (int y = 5; y < 9; ++y)  // a planted fault of +0.5 in the second band
      for (int x = 10; x < 15; ++x) t.channels[1].samples[t.index(x, y)] += 0.5f;
    write_exr(scratch_path("viewer_test.exr"), t);
    write_exr(scratch_path("viewer_reference.exr"), measured(1.0));
    write_exr(scratch_path("viewer_u.exr"), measured(0.01));
    test = read_image(scratch_path("viewer_test.exr"));
    reference = read_image(scratch_path("viewer_reference.exr"));
    u = read_image(scratch_path("viewer_u.exr"));
  }
};

ImageSet image_set(const Pair& pair) {
  std::vector<int> surface(pair.test.pixel_count(), -1);
  for (std::size_t i = surface.size() / 2; i < surface.size(); ++i) surface[i] = 1;
  ImageSetOptions options;
  options.surface_of_pixel = surface;
  options.surfaces = {"lamp", kHostile};
  return make_image_set({kHostile, &pair.test}, {"Photograph", &pair.reference, &pair.u}, options);
}

std::string page(const char* name, std::optional<ImageSet> set) {
  const std::vector<float> values(12, 0.5f);
  Report report;
  report.title = "viewer";
  report.sections = {
      {"Pictures",
       {PictureRow{{{"Test", false_colour(4, 3, values, {0, 1}, "radiance", "1"), "the test"}},
                   "caption",
                   std::move(set)}}}};
  const std::string path = scratch_path(name);
  write_file_atomically(path, to_html(report));
  return path;
}

/// A page with a viewer in a browser.
class Viewer : public testing::Test {
 protected:
  void SetUp() override {
    if (Chromium::program().empty()) GTEST_SKIP() << "no Chromium here";
    browser_ = std::make_unique<Chromium>();
  }
  void TearDown() override {
    if (browser_) {
      EXPECT_THAT(browser_->complaints(), testing::IsEmpty());
    }
  }
  void open(const std::string& path) {
    browser_->open(path);
    browser_->wait_until("document.querySelector('.viewer .inspector td') !== null");
    browser_->evaluate(
        "document.querySelector('.stage').scrollIntoView({block: 'center', behavior: 'instant'})");
    settle();
  }
  void settle() {  // what a change does is drawn in the next frame
    browser_->evaluate(
        "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))");
  }
  double number(const std::string& expression) { return std::stod(browser_->evaluate(expression)); }
  std::string text(const std::string& selector) {
    return browser_->evaluate("document.querySelector(" + quoted(selector) + ").textContent");
  }
  static std::string quoted(const std::string& s) { return "`" + s + "`"; }

  /// Where the centre of a pixel is on the window, the picture being fitted into its pane.
  std::pair<double, double> place(int x, int y) {
    const double left = number(kCanvas + ".left"), top = number(kCanvas + ".top"),
                 width = number(kCanvas + ".width"), height = number(kCanvas + ".height");
    const double scale = std::min(width / kWidth, height / kHeight);
    return {left + width / 2 + (x + 0.5 - kWidth / 2.0) * scale,
            top + height / 2 + (y + 0.5 - kHeight / 2.0) * scale};
  }
  void click_pixel(int x, int y) {
    const auto [px, py] = place(x, y);
    browser_->click(px, py);
    settle();
  }
  /// Chooses a radio button as the keyboard does.
  void choose(const std::string& value) {
    browser_->evaluate("document.querySelector('.viewer input[value=" + value + "]').focus()");
    browser_->press(" ");
    settle();
  }
  void set_slider(const std::string& key, const std::string& value) {
    browser_->evaluate("{ const s = document.querySelector('#viewer-1-" + key +
                       "'); s.value = " + value + "; s.dispatchEvent(new Event('input')); }");
    settle();
  }
  /// Red, green and blue of the canvas at a pixel's centre, as one number.
  double colour_at(int x, int y) {
    const auto [px, py] = place(x, y);
    return number(
        "(() => { const c = document.querySelector('.pane canvas'), b = "
        "c.getBoundingClientRect(), copy = document.createElement('canvas').getContext('2d', "
        "{ willReadFrequently: true }); copy.drawImage(c, b.left - " +
        std::to_string(px) + ", b.top - " + std::to_string(py) +
        "); const d = copy.getImageData(0, 0, 1, 1).data; "
        "return d[0] * 65536 + d[1] * 256 + d[2]; })()");
  }
  /// The number at the front of an inspector cell.
  double read(const std::string& key) {
    return number("parseFloat(document.querySelector('.inspector [data-value=" + key +
                  "]').textContent)");
  }

  inline static const std::string kCanvas =
      "document.querySelector('.pane canvas').getBoundingClientRect()";
  std::unique_ptr<Chromium> browser_;
};

TEST_F(Viewer, InspectorSaysWhatTheFilesHold) {
  const Pair pair;
  open(page("inspector.html", image_set(pair)));
  for (const auto& [x, y] : {std::pair{0, 0}, {12, 6}, {39, 29}, {20, 14}}) {
    click_pixel(x, y);
    for (const int b : {0, 1, 2}) {
      set_slider("band", std::to_string(b));
      const std::size_t i = pair.test.index(x, y);
      const double t = pair.test.channels[b].samples[i], r = pair.reference.channels[b].samples[i];
      EXPECT_THAT(text(".inspector [data-value=where]"),
                  HasSubstr("(" + std::to_string(x) + ", " + std::to_string(y) + ")"));
      // Rounded to a half (2^-11) and to four digits, or to the second digit of u = 1 %: each
      // by at most 0.05 %.
      EXPECT_NEAR(read("test"), t, t / 1000.0) << x << " " << y << " " << b;
      EXPECT_NEAR(read("reference"), r, r / 1000.0);
      EXPECT_NEAR(read("sigma"), (t - r) / (0.01 * r), 0.01 * std::abs(t - r) / (0.01 * r) + 0.1);
    }
  }
  EXPECT_THAT(text(".inspector [data-value=reference]"), HasSubstr("±"));
  EXPECT_THAT(text(".inspector [data-value=unit]"), HasSubstr("W m⁻² sr⁻¹ nm⁻¹"));
  EXPECT_THAT(text(".inspector"), HasSubstr("standard uncertainty (k = 1)"));
}

TEST_F(Viewer, WorksFromTheKeyboardAndSpeaks) {
  open(page("keyboard.html", image_set(Pair())));
  click_pixel(10, 10);
  EXPECT_EQ(browser_->evaluate("document.activeElement.getAttribute('role')"), "\"application\"");
  browser_->press("ArrowRight");
  browser_->press("ArrowDown", true);
  settle();
  EXPECT_THAT(text(".inspector [data-value=where]"), HasSubstr("(11, 20)"));
  const std::string spoken = text(".viewer [aria-live=polite]");
  for (const char* part : {"Pixel (11, 20)", "550 nm", "Photograph", "W m⁻²", "In sigmas"})
    EXPECT_THAT(spoken, HasSubstr(part));
  const std::string zoom = "parseFloat(document.querySelector('.zoom output').textContent)";
  const double fitted = number(zoom);
  browser_->press("+");
  settle();
  EXPECT_GT(number(zoom), 1.4 * fitted);
  browser_->press("0");
  settle();
  EXPECT_EQ(number(zoom), fitted);

  // Tab reaches every control once, in the order of the page, and shows where it is.
  browser_->evaluate("document.querySelector('.viewer input').focus()");
  std::string last;
  int stops = 0;
  for (; stops < 40 &&
         browser_->evaluate("document.activeElement.closest('.viewer') !== null") == "true";
       ++stops) {
    EXPECT_EQ(browser_->evaluate(
                  "(() => { const e = document.activeElement; const box = e.type === 'radio' ? "
                  "e.nextSibling : e; return getComputedStyle(box).outlineStyle !== 'none' && "
                  "(e.labels?.length > 0 || e.getAttribute('aria-label') !== null || "
                  "(e.tagName === 'BUTTON' && e.textContent !== '')); })()"),
              "true")
        << browser_->evaluate("document.activeElement.outerHTML.slice(0, 200)");
    browser_->press("Tab");
  }
  EXPECT_GE(stops, 10);
  EXPECT_LT(stops, 40);
}

TEST_F(Viewer, ShowsSwapWipeDifferenceExposureAndBands) {
  open(page("views.html", image_set(Pair())));
  set_slider("band", "1");
  choose("difference");
  const double fault = colour_at(12, 6), other = colour_at(30, 20);
  EXPECT_NE(fault, other);                             // the planted fault stands out
  EXPECT_GT(fault, 0x900000);                          // and is red: the test is brighter
  EXPECT_THAT(text(".strip-labels"), HasSubstr("4"));  // sigmas
  choose("absolute");
  EXPECT_THAT(text(".bar"), HasSubstr("W m⁻² sr⁻¹ nm⁻¹"));
  choose("swap");
  choose("grey");
  const double test = colour_at(12, 6);
  browser_->evaluate("document.querySelector('.stage').focus()");
  browser_->press(" ");
  settle();
  EXPECT_THAT(text("button.swap"), HasSubstr("Photograph"));
  const double reference = colour_at(12, 6);
  EXPECT_LT(reference, test);
  set_slider("ev", "-1");
  EXPECT_LT(colour_at(12, 6), reference);
  choose("wipe");
  set_slider("wipe", "0.5");
  const auto [x, y] = place(20, 15);
  browser_->drag(x - 3, y, x - 120, y);  // the divider lies left of pixel 20
  settle();
  EXPECT_LT(number("document.querySelector('#viewer-1-wipe').valueAsNumber"), 0.45);
  choose("side");
  EXPECT_EQ(number("[...document.querySelectorAll('.pane')].filter((p) => !p.hidden).length"), 2);
}

TEST_F(Viewer, DrawsProfilesAndSpectra) {
  open(page("plots.html", image_set(Pair())));
  choose("profile");
  const auto [x0, y0] = place(5, 7);
  const auto [x1, y1] = place(30, 7);
  browser_->drag(x0, y0, x1, y1);
  settle();
  EXPECT_THAT(text(".viewer-plots"), HasSubstr("Profile from (5, 7) to (30, 7)"));
  choose("look");
  click_pixel(3, 25);
  choose("surface");
  EXPECT_THAT(text(".viewer-side"), HasSubstr("mean over </script>"));
  click_pixel(3, 2);  // no surface: the pixel's own spectrum
  EXPECT_THAT(text(".viewer-side"), HasSubstr("pixel (3, 2)"));
  EXPECT_GE(number("document.querySelectorAll('.viewer-plots rect').length"), 1);
}

TEST_F(Viewer, HostileNamesStayText) {
  open(page("hostile.html", image_set(Pair())));
  EXPECT_EQ(browser_->evaluate("typeof hacked"), "\"undefined\"");
  EXPECT_EQ(number("document.querySelectorAll('img').length"), 1);  // the still picture
  EXPECT_THAT(text(".pane-label"), HasSubstr("onerror="));
}

TEST_F(Viewer, UnpacksWithoutTheBrowsersHelp) {
  const std::string path = page("inflate.html", image_set(Pair()));
  open(path);
  click_pixel(12, 6);
  const std::string with_help = text(".inspector");
  browser_->before_every_page("delete window.DecompressionStream;");
  open(path);
  ASSERT_EQ(browser_->evaluate("typeof DecompressionStream"), "\"undefined\"");
  click_pixel(12, 6);
  EXPECT_EQ(text(".inspector"), with_help);
}

TEST_F(Viewer, BrokenNumbersLeaveTheStillPictures) {
  ImageSet set = image_set(Pair());
  set.packed.resize(set.packed.size() / 2);
  browser_->open(page("broken.html", std::move(set)));
  browser_->wait_until("document.querySelector('[role=status]') !== null");
  EXPECT_THAT(text("[role=status]"), HasSubstr("could not be unpacked"));
  EXPECT_GT(number("document.querySelector('.panel img').getBoundingClientRect().width"), 0.0);
}

TEST_F(Viewer, PaperShowsTheStillPictures) {
  open(page("print.html", image_set(Pair())));
  const std::string shown =
      "(() => [...document.querySelectorAll('.viewer, .panels')].map((e) => "
      "getComputedStyle(e).display).join())()";
  EXPECT_EQ(browser_->evaluate(shown), "\"block,none\"");
  browser_->emulate({}, "print");
  EXPECT_EQ(browser_->evaluate(shown), "\"none,grid\"");
}

}  // namespace
}  // namespace truebox
