// SPDX-License-Identifier: BSD-3-Clause
#include "walkthrough/walkthrough.h"

#include <gmock/gmock.h>

#include <fstream>

#include "support/chromium.h"
#include "support/scratch.h"
#include "support/tiny_scenes.h"

namespace truebox {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

// A furnace (B = 2 in every band) seen from its middle, with a name that must be escaped.
std::string furnace_page() {
  static const std::string page = [] {
    Scene scene = tiny::cube(1.0, 0.5, 1.0);
    scene.surfaces[4].name = "wall </script> & <b>";
    scene.bands = WavelengthGrid::from_centres({450.0, 550.0, 650.0});
    scene.materials = {{"grey", Reflectance(3, 0.5), RadiantExitance(3, 1.0)}};
    CameraDescription camera;
    camera.position_m = Vec3(0.5, 0.5, 0.5);
    camera.direction = -Vec3::UnitX();
    camera.up = Vec3::UnitZ();
    scene.cameras = {{"middle", camera}};
    PredictOptions options;
    options.elements = 300;
    return walkthrough_html(
        Prediction(scene, options),
        read_observer(std::string(TRUEBOX_REFERENCE_DIR) + "/colour/cie1931_2deg_xyz.csv",
                      "CIE 1931 2 deg"),
        "furnace <1>.toml");
  }();
  return page;
}

std::string written(const char* name, const std::string& page) {
  const std::string path = scratch_path(name);
  std::ofstream(path, std::ios::binary) << page;
  return path;
}

class Walkthrough : public testing::Test {
 protected:
  void SetUp() override {
    if (Chromium::program().empty()) GTEST_SKIP() << "no Chromium here";
  }
  static void open(Chromium& browser) {
    browser.open(written("walk.html", furnace_page()));
    browser.wait_until("document.documentElement.dataset.ready === 'true'");
  }
  // Chooses an entry or moves a slider as a reader would: value, then the event.
  static void set(Chromium& browser, const std::string& id, const std::string& value) {
    browser.evaluate("(() => { const e = document.getElementById('" + id + "'); e.value = '" +
                     value + "'; e.dispatchEvent(new Event('input')); return 1; })()");
  }
  static std::string text(Chromium& browser, const std::string& id) {
    return browser.evaluate("document.getElementById('" + id + "').textContent");
  }
  // What the page is to blame for; a software driver remarks on its own speed.
  static std::vector<std::string> complaints(const Chromium& browser) {
    std::vector<std::string> found = browser.complaints();
    std::erase_if(found, [](const std::string& text) {
      return text.find("GL Driver Message (OpenGL, Performance") != std::string::npos;
    });
    return found;
  }
  // The colour in the middle of the drawing: "red,green,blue".
  static std::string middle(Chromium& browser) {
    return browser.evaluate(
        "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => {"
        "const v = document.getElementById('view'), g = v.getContext('webgl');"
        "const p = new Uint8Array(4);"
        "g.readPixels(v.width >> 1, v.height >> 1, 1, 1, g.RGBA, g.UNSIGNED_BYTE, p);"
        "done(p.slice(0, 3).join(',')); })))");
  }
};

TEST(WalkthroughPage, IsOneFileThatFetchesNothing) {
  const std::string page = furnace_page();
  EXPECT_LT(page.size(), 2'000'000u);
  EXPECT_THAT(page, HasSubstr("default-src 'none'"));
  EXPECT_THAT(page, Not(HasSubstr("<script src")));
  EXPECT_THAT(page, HasSubstr("furnace &lt;1&gt;.toml"));
  EXPECT_THAT(page, HasSubstr("wall <\\/script>"));
}

TEST_F(Walkthrough, ShowsTheFurnaceWithItsValueAndBound) {
  Chromium browser(1280, 800);
  open(browser);
  EXPECT_EQ(browser.evaluate("document.getElementById('message').hidden"), "true");
  browser.move(500, 400);
  EXPECT_THAT(text(browser, "reading"), HasSubstr("wall </script> & <b>, 550 nm: 2 W m"));
  EXPECT_THAT(text(browser, "reading"), HasSubstr("error bound"));
  // Grey: everything shines, so the brightest value is white; one stop down is half of it, which
  // sRGB encodes as 188 (IEC 61966-2-1).
  set(browser, "show", "grey");
  EXPECT_EQ(middle(browser), "\"255,255,255\"");
  set(browser, "exposure", "-1");
  EXPECT_EQ(middle(browser), "\"188,188,188\"");
  // False colour: the top of the map is viridis' yellow.
  set(browser, "show", "false");
  set(browser, "exposure", "0");
  EXPECT_EQ(text(browser, "scale-title"), "\"Radiosity at 550 nm / W m⁻² nm⁻¹\"");
  EXPECT_EQ(text(browser, "ticks"), "\"00.511.5≥ 2\"");
  set(browser, "band", "2");
  EXPECT_THAT(text(browser, "scale-title"), HasSubstr("650 nm"));
  EXPECT_THAT(complaints(browser), IsEmpty());
}

TEST_F(Walkthrough, IsWalkedAndTurnedByKeysAndPointer) {
  Chromium browser(1280, 800);
  open(browser);
  const auto frames = [&] {
    return std::stoi(browser.evaluate("Number(document.documentElement.dataset.frames)"));
  };
  const auto moves = [&](const auto& act) {
    const int before = frames();
    act();
    browser.wait_until("Number(document.documentElement.dataset.frames) > " +
                       std::to_string(before));
    return true;
  };
  browser.evaluate("(document.getElementById('view').focus(), 1)");
  EXPECT_TRUE(moves([&] { browser.press("ArrowLeft"); }));
  EXPECT_TRUE(moves([&] { browser.drag(500, 400, 560, 420); }));
  browser.evaluate("(document.querySelector('input[value=walk]').click(), 1)");
  EXPECT_EQ(browser.evaluate("document.getElementById('pad').hidden"), "false");
  browser.evaluate("(document.getElementById('view').focus(), 1)");
  EXPECT_TRUE(moves([&] { browser.press("w"); }));
  EXPECT_TRUE(moves([&] { browser.drag(500, 400, 560, 420); }));
  EXPECT_TRUE(moves([&] { browser.evaluate("(document.getElementById('mesh').click(), 1)"); }));
  // Everything that can be used has a name and is reached by Tab.
  EXPECT_EQ(browser.evaluate(
                "[...document.querySelectorAll('button, input, select, canvas')].filter((e) =>"
                " !(e.labels && e.labels.length) && !e.getAttribute('aria-label') &&"
                " !(e.tagName === 'BUTTON' && e.textContent.trim())).length"),
            "0");
  EXPECT_THAT(complaints(browser), IsEmpty());
}

TEST_F(Walkthrough, FitsAPhone) {
  Chromium browser(390, 844);
  open(browser);
  EXPECT_EQ(browser.evaluate("document.documentElement.scrollWidth <= innerWidth"), "true");
  EXPECT_EQ(browser.evaluate("document.getElementById('fold').getAttribute('aria-expanded')"),
            "\"false\"");
  set(browser, "show", "false");
  for (const char* id : {"scale", "controls", "view"})
    EXPECT_EQ(browser.evaluate("(() => { const r = document.getElementById('" + std::string(id) +
                               "').getBoundingClientRect(); return r.left >= 0 && r.top >= 0 && "
                               "r.right <= innerWidth && r.bottom <= innerHeight; })()"),
              "true")
        << id;
  EXPECT_THAT(complaints(browser), IsEmpty());
}

TEST_F(Walkthrough, SaysSoWithoutWebGl) {
  std::string page = furnace_page();
  page.insert(page.find("<canvas"),
              "<script>HTMLCanvasElement.prototype.getContext = () => null;</script>");
  Chromium browser(800, 600);
  browser.open(written("no_webgl.html", page));
  browser.wait_until("!document.getElementById('message').hidden");
  EXPECT_THAT(text(browser, "message"), HasSubstr("WebGL"));
  EXPECT_THAT(complaints(browser), IsEmpty());
}

}  // namespace
}  // namespace truebox
