// SPDX-License-Identifier: BSD-3-Clause
#include "image/channel_map.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <sstream>

#include "image/spectral_image.h"
#include "radiometry/input_error.h"

namespace truebox {
namespace {

constexpr char kWavelength[] = "{nm}";

struct Rule {
  std::string name, channel;
  double factor = 1.0;
};

std::string trimmed(const std::string& text) {
  const auto from = text.find_first_not_of(" \t");
  return from == std::string::npos ? std::string()
                                   : text.substr(from, text.find_last_not_of(" \t") - from + 1);
}

std::vector<Rule> parse(const std::string& map) {
  const auto fail = [](const std::string& found) {
    throw InputError("channel map", 0, "NAME=CHANNEL or NAME=CHANNEL*FACTOR, separated by \",\"",
                     "\"" + found + "\"");
  };
  // A decimal comma ("S0.400,0nm=...") is no separator: it stands between digits.
  std::vector<std::string> entries(1);
  for (std::size_t i = 0; i < map.size(); ++i) {
    const auto digit = [&](std::size_t k) {
      return k < map.size() && map[k] >= '0' && map[k] <= '9';
    };
    if (map[i] == ',' && !(i > 0 && digit(i - 1) && digit(i + 1)))
      entries.emplace_back();
    else
      entries.back() += map[i];
  }
  std::vector<Rule> rules;
  for (const std::string& entry : entries) {
    const std::size_t equals = entry.find('='), star = entry.rfind('*');
    if (equals == std::string::npos) fail(entry);
    Rule rule;
    rule.name = trimmed(entry.substr(0, equals));
    if (star != std::string::npos && star > equals) {
      const std::string number = trimmed(entry.substr(star + 1));
      char* end = nullptr;
      rule.factor = std::strtod(number.c_str(), &end);
      if (number.empty() || *end != '\0' || !std::isfinite(rule.factor)) fail(entry);
      rule.channel = trimmed(entry.substr(equals + 1, star - equals - 1));
    } else {
      rule.channel = trimmed(entry.substr(equals + 1));
    }
    const bool named = rule.name.find(kWavelength) != std::string::npos;
    if (rule.name.empty() || rule.channel.empty() ||
        named != (rule.channel.find(kWavelength) != std::string::npos))
      fail(entry);
    rules.push_back(std::move(rule));
  }
  return rules;
}

// The wavelength where `pattern` has {nm}; nothing if the name is of another form.
std::optional<double> wavelength_in(const std::string& name, const std::string& pattern) {
  const std::size_t at = pattern.find(kWavelength);
  const std::string before = pattern.substr(0, at), after = pattern.substr(at + 4);
  if (name.size() <= before.size() + after.size() || !name.starts_with(before) ||
      !name.ends_with(after))
    return std::nullopt;
  std::string number = name.substr(before.size(), name.size() - before.size() - after.size());
  for (char& c : number)
    if (c == ',' || c == '_') c = '.';
  if (number.find_first_not_of("0123456789.") != std::string::npos ||
      std::count(number.begin(), number.end(), '.') > 1)
    return std::nullopt;
  return std::strtod(number.c_str(), nullptr);
}

void add(Image& out, const Channel& from, const std::string& name, double factor) {
  const double nm = spectral_channel_wavelength_nm(name);
  Channel& to = out.add_channel(nm > 0.0 ? spectral_channel_name(nm) : name);
  for (std::size_t i = 0; i < from.samples.size(); ++i)
    to.samples[i] = factor == 1.0 ? from.samples[i] : static_cast<float>(factor * from.samples[i]);
}

}  // namespace

Image map_channels(const Image& image, const std::string& map) {
  Image out(image.width, image.height);
  out.attributes = image.attributes;
  for (const Rule& rule : parse(map)) {
    const std::size_t before = out.channels.size();
    const std::size_t at = rule.name.find(kWavelength);
    for (const Channel& channel : image.channels) {
      if (at == std::string::npos) {
        if (channel.name == rule.channel) add(out, channel, rule.name, rule.factor);
      } else if (const auto nm = wavelength_in(channel.name, rule.channel)) {
        std::ostringstream number;
        number.precision(9);
        number << *nm;
        add(out, channel, std::string(rule.name).replace(at, 4, number.str()), rule.factor);
      }
    }
    if (out.channels.size() > before) continue;
    std::string known;
    for (const Channel& channel : image.channels)
      known += (known.empty() ? "" : ", ") + channel.name;
    throw MismatchError("the image has no channel \"" + rule.channel + "\"; it has " + known);
  }
  for (std::size_t a = 0; a < out.channels.size(); ++a)
    for (std::size_t b = 0; b < a; ++b)
      if (out.channels[a].name == out.channels[b].name)
        throw InputError("channel map", 0, "each name once",
                         "\"" + out.channels[a].name + "\" twice");
  return out;
}

}  // namespace truebox
