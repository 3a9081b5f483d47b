// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace truebox {

/// A headless Chromium that a test drives as a reader would: mouse, keyboard, what the page then
/// says. It talks over the browser's debugging pipe (Chrome DevTools Protocol), so no port is open.
/// Every member throws std::runtime_error if the browser does not answer within a minute.
class Chromium {
 public:
  /// The browser's path: $TRUEBOX_CHROMIUM, else chromium or google-chrome in $PATH; "" if there is
  /// none, and the test should then GTEST_SKIP().
  static std::string program();

  explicit Chromium(int width_px = 1280, int height_px = 900);
  ~Chromium();
  Chromium(const Chromium&) = delete;
  Chromium& operator=(const Chromium&) = delete;

  /// Loads a file and waits for its load event.
  void open(const std::filesystem::path& page);

  /// A script that runs in every page opened from now on, before the page's own.
  void before_every_page(const std::string& script);

  /// The value of a JavaScript expression as JSON, a promise's when it is kept: "3", "\"text\"",
  /// "null". Throws std::runtime_error with the message of what the expression throws.
  std::string evaluate(const std::string& expression);

  /// Waits until an expression is true; throws std::runtime_error after half a minute.
  void wait_until(const std::string& expression);

  /// Positions in CSS px from the top left of the window.
  void click(double x, double y);
  void drag(double from_x, double from_y, double to_x, double to_y);
  void move(double x, double y);
  /// "Tab", "Enter", "ArrowLeft", "Escape", " ", or one character; `shift` held down or not.
  void press(const std::string& key, bool shift = false);

  void resize(int width_px, int height_px);
  /// CSS media features, as {"prefers-color-scheme", "dark"}; `type` is "", "screen" or "print".
  void emulate(const std::map<std::string, std::string>& features, const std::string& type = "");
  /// What the window shows as PNG; the whole page where `whole`.
  void screenshot(const std::filesystem::path& png, bool whole = false);

  /// Console errors and warnings, uncaught exceptions, and every request but that of an opened
  /// page and of data: inside it. A page that works has none.
  const std::vector<std::string>& complaints() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace truebox
