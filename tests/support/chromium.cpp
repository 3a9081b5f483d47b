// SPDX-License-Identifier: BSD-3-Clause
#include "support/chromium.h"

#include <unistd.h>

#include <cctype>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>

#include "support/debugging_pipe.h"
#include "support/scratch.h"

namespace truebox {
namespace {

using Json = nlohmann::json;

constexpr int kAnswer_ms = 60'000;

std::vector<std::string> command_line(int width_px, int height_px) {
  // As root (in a container) there is no sandbox; the pages are our own.
  return {Chromium::program(),
          "--headless=new",
          "--no-sandbox",
          "--disable-gpu",
          "--enable-unsafe-swiftshader",  // WebGL without a graphics card
          "--disable-dev-shm-usage",
          "--no-first-run",
          "--disable-background-networking",
          "--disable-component-update",
          "--disable-sync",
          "--disable-extensions",
          "--hide-scrollbars",
          "--force-device-scale-factor=1",
          "--user-data-dir=" + scratch_path("chromium"),
          "--window-size=" + std::to_string(width_px) + "," + std::to_string(height_px),
          "--remote-debugging-pipe",
          "about:blank"};
}

std::string decoded(const std::string& base64) {
  std::string bytes;
  unsigned group = 0;
  int bits = 0;
  for (char c : base64) {
    const char* alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const char* found = std::strchr(alphabet, c);
    if (found == nullptr) break;
    group = (group << 6) | static_cast<unsigned>(found - alphabet);
    if ((bits += 6) < 8) continue;
    bits -= 8;
    bytes += static_cast<char>(group >> bits);
  }
  return bytes;
}

}  // namespace

struct Chromium::State {
  DebuggingPipe pipe;
  int last_id = 0;
  std::string session;
  std::string page;  // the address that may be asked for
  bool loaded = false;
  std::vector<std::string> complaints;

  State(int width_px, int height_px) : pipe(command_line(width_px, height_px)) {}

  void note(const Json& event) {
    const std::string method = event.value("method", "");
    const Json& what = event.contains("params") ? event["params"] : Json::object();
    if (method == "Page.loadEventFired") loaded = true;
    if (method == "Runtime.exceptionThrown")
      complaints.push_back("exception: " + what["exceptionDetails"].dump());
    if (method == "Log.entryAdded" && what["entry"]["level"] != "verbose")
      complaints.push_back("log: " + what["entry"].dump());
    if (method == "Runtime.consoleAPICalled" &&
        (what["type"] == "error" || what["type"] == "warning" || what["type"] == "assert"))
      complaints.push_back("console: " + what["args"].dump());
    if (method == "Network.requestWillBeSent") {
      const std::string url = what["request"]["url"];
      if (url != page && !url.starts_with("data:"))
        complaints.push_back("request: " + url.substr(0, 200));
    }
  }

  /// Receives until `done`; events are noted on the way. The answer to `id`, if that came.
  template <typename Done>
  Json receive_until(int id, Done done) {
    while (!done()) {
      const auto message = pipe.receive(kAnswer_ms);
      if (!message) throw std::runtime_error("Chromium does not answer");
      Json json = Json::parse(*message);
      if (json.contains("id") && json["id"] == id) return json;
      note(json);
    }
    return {};
  }

  Json call(const std::string& method, const Json& parameters = Json::object()) {
    Json message = {{"id", ++last_id}, {"method", method}, {"params", parameters}};
    if (!session.empty()) message["sessionId"] = session;
    pipe.send(message.dump());
    const Json answer = receive_until(last_id, [] { return false; });
    if (answer.contains("error")) throw std::runtime_error(method + ": " + answer["error"].dump());
    return answer.at("result");
  }

  void mouse(const char* type, double x, double y, bool held) {
    call("Input.dispatchMouseEvent", {{"type", type},
                                      {"x", x},
                                      {"y", y},
                                      {"button", held ? "left" : "none"},
                                      {"buttons", held ? 1 : 0},
                                      {"clickCount", held ? 1 : 0}});
  }
};

std::string Chromium::program() {
  if (const char* chosen = std::getenv("TRUEBOX_CHROMIUM")) return chosen;
  const char* path = std::getenv("PATH");
  for (const char* name : {"chromium", "chromium-browser", "google-chrome"}) {
    std::istringstream folders(path != nullptr ? path : "");
    for (std::string folder; std::getline(folders, folder, ':');)
      if (::access((folder + "/" + name).c_str(), X_OK) == 0) return folder + "/" + name;
  }
  return "";
}

Chromium::Chromium(int width_px, int height_px)
    : state_(std::make_unique<State>(width_px, height_px)) {
  const Json target = state_->call("Target.createTarget", {{"url", "about:blank"}});
  state_->session = state_->call(
      "Target.attachToTarget", {{"targetId", target["targetId"]}, {"flatten", true}})["sessionId"];
  for (const char* domain : {"Page", "Runtime", "Log", "Network"})
    state_->call(std::string(domain) + ".enable");
  resize(width_px, height_px);
}

Chromium::~Chromium() = default;

void Chromium::open(const std::filesystem::path& page) {
  state_->page = "file://" + std::filesystem::absolute(page).string();
  state_->loaded = false;
  state_->call("Page.navigate", {{"url", state_->page}});
  state_->receive_until(-1, [this] { return state_->loaded; });
}

void Chromium::before_every_page(const std::string& script) {
  state_->call("Page.addScriptToEvaluateOnNewDocument", {{"source", script}});
}

std::string Chromium::evaluate(const std::string& expression) {
  const Json answer = state_->call("Runtime.evaluate", {{"expression", expression},
                                                        {"awaitPromise", true},
                                                        {"returnByValue", true},
                                                        {"userGesture", true}});
  if (answer.contains("exceptionDetails"))
    throw std::runtime_error(expression + ": " + answer["exceptionDetails"].dump());
  const Json& result = answer["result"];
  if (result.contains("value")) return result["value"].dump();
  return result.value("unserializableValue", "null");  // NaN, Infinity
}

void Chromium::wait_until(const std::string& expression) {
  const std::string poll =
      "new Promise((done) => { const end = Date.now() + 30000; const look = () => (" + expression +
      ") ? done(true) : Date.now() > end ? done(false) : setTimeout(look, 20); look(); })";
  if (evaluate(poll) != "true") throw std::runtime_error("never came true: " + expression);
}

void Chromium::click(double x, double y) {
  move(x, y);
  state_->mouse("mousePressed", x, y, true);
  state_->mouse("mouseReleased", x, y, true);
}

void Chromium::drag(double from_x, double from_y, double to_x, double to_y) {
  move(from_x, from_y);
  state_->mouse("mousePressed", from_x, from_y, true);
  for (int step = 1; step <= 4; ++step)
    state_->mouse("mouseMoved", from_x + (to_x - from_x) * step / 4.0,
                  from_y + (to_y - from_y) * step / 4.0, true);
  state_->mouse("mouseReleased", to_x, to_y, true);
}

void Chromium::move(double x, double y) { state_->mouse("mouseMoved", x, y, false); }

void Chromium::press(const std::string& key, bool shift) {
  static const std::map<std::string, int> kCodes = {
      {"Tab", 9},        {"Enter", 13},    {"Escape", 27},     {" ", 32},
      {"PageUp", 33},    {"PageDown", 34}, {"End", 35},        {"Home", 36},
      {"ArrowLeft", 37}, {"ArrowUp", 38},  {"ArrowRight", 39}, {"ArrowDown", 40}};
  const auto code = kCodes.find(key);
  Json event = {
      {"key", key},
      {"code", key == " " ? "Space" : key},
      {"modifiers", shift ? 8 : 0},
      {"windowsVirtualKeyCode", code != kCodes.end() ? code->second : std::toupper(key[0])}};
  const std::string text = key == "Enter" ? "\r" : key.size() == 1 ? key : "";
  event["type"] = text.empty() ? "rawKeyDown" : "keyDown";
  if (!text.empty()) event["text"] = text;
  state_->call("Input.dispatchKeyEvent", event);
  event["type"] = "keyUp";
  event.erase("text");
  state_->call("Input.dispatchKeyEvent", event);
}

void Chromium::resize(int width_px, int height_px) {
  state_->call(
      "Emulation.setDeviceMetricsOverride",
      {{"width", width_px}, {"height", height_px}, {"deviceScaleFactor", 1}, {"mobile", false}});
}

void Chromium::emulate(const std::map<std::string, std::string>& features,
                       const std::string& type) {
  Json list = Json::array();
  for (const auto& [name, value] : features) list.push_back({{"name", name}, {"value", value}});
  state_->call("Emulation.setEmulatedMedia", {{"media", type}, {"features", list}});
}

void Chromium::screenshot(const std::filesystem::path& png, bool whole) {
  const Json answer = state_->call("Page.captureScreenshot", {{"captureBeyondViewport", whole}});
  std::ofstream(png, std::ios::binary) << decoded(answer["data"].get<std::string>());
}

const std::vector<std::string>& Chromium::complaints() const { return state_->complaints; }

}  // namespace truebox
