// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <set>
#include <tuple>

#include "commands.h"
#include "document/writers.h"
#include "figures/line_plot.h"
#include "image/image_file.h"
#include "sweep.h"

namespace truebox::app {
namespace {

// Two standard errors of the reference hold for 95 % of normal answers where nothing else is wrong;
// the bands of one place share their noise, so of a dozen places the share itself is good to 6 %.
constexpr double kHeldExpected = 0.95;
constexpr double kHeldWanted = 0.90;
constexpr double kClearReference = 0.5;

std::string held_text(const SweepPoint& p) {
  return fmt::format("{:.1f} %{}", 100.0 * p.bound_held, p.bound_is_promised ? "" : " *");
}

void print(const Sweep& sweep) {
  fmt::print("{}\nerror: {}\nagainst: {}\n{:<25}{:<24}{:>10}{:>11}{:>11}{:>11}{:>11}  work\n",
             sweep.title, sweep.error_name, sweep.reference, "method", "setting", "time / s",
             "error", "largest", "bound", "bound held");
  for (const SweepPoint& p : sweep.points)
    fmt::print("{:<25}{:<24}{:>10.3g}{:>11.2e}{:>11.2e}{:>11.2e}{:>11}  {}{}\n", p.method,
               p.setting, p.cpu_s, p.error, p.largest_error, p.bound, held_text(p), p.work,
               p.on_front ? ", front" : "");
  fmt::print("The reference itself is good to {:.2g}. * the method calls this bound an estimate.\n",
             sweep.floor);
  for (const std::string& reason : sweep.left_out) fmt::print("left out: {}\n", reason);
}

nlohmann::json as_json(const Sweep& sweep) {
  nlohmann::json points = nlohmann::json::array();
  for (const SweepPoint& p : sweep.points) {
    points.push_back({{"method", p.method},
                      {"setting", p.setting},
                      {"cpu_s", p.cpu_s},
                      {"error", p.error},
                      {"largest_error", p.largest_error},
                      {"mean_bound", p.bound},
                      {"bound_held", p.bound_held},
                      {"bound_is_promised", p.bound_is_promised},
                      {"work", p.work},
                      {"on_front", p.on_front}});
    if (p.matrix_passes) points.back()["matrix_passes"] = *p.matrix_passes;
  }
  return {{"title", sweep.title},
          {"error", sweep.error_name},
          {"reference", sweep.reference},
          {"reference_error", sweep.floor},
          {"errors_told_apart_above", sweep.resolved},
          {"left_out", sweep.left_out},
          {"points", points}};
}

std::vector<SweepPoint> front_of(const Sweep& sweep) {
  std::vector<SweepPoint> best;
  std::copy_if(sweep.points.begin(), sweep.points.end(), std::back_inserter(best),
               [](const SweepPoint& p) { return p.on_front; });
  std::sort(best.begin(), best.end(),
            [](const SweepPoint& a, const SweepPoint& b) { return a.cpu_s < b.cpu_s; });
  return best;
}

std::string as_svg(const Sweep& sweep) {
  LinePlot plot;
  plot.title = sweep.title + ": error against time";
  plot.x = {"processor time", "s", true};
  plot.y = {sweep.error_name, "1", true};
  for (const SweepPoint& p : sweep.points) {
    auto series = std::find_if(plot.series.begin(), plot.series.end(),
                               [&](const PlotSeries& s) { return s.name == p.method; });
    if (series == plot.series.end()) {
      plot.series.push_back({p.method, {}, {}});
      plot.series.back().markers = true;
      series = plot.series.end() - 1;
    }
    series->x.push_back(p.cpu_s);
    series->y.push_back(p.error);
  }
  PlotSeries front{"Pareto front", {}, {}}, floor{"the reference's own error", {}, {}};
  front.dashed = floor.dashed = true;
  for (const SweepPoint& p : front_of(sweep)) {
    front.x.push_back(p.cpu_s);
    front.y.push_back(p.error);
  }
  double first = 1e300, last = 0.0;
  for (const SweepPoint& p : sweep.points) {
    first = std::min(first, p.cpu_s);
    last = std::max(last, p.cpu_s);
  }
  if (sweep.floor > 0.0) floor.x = {first, last}, floor.y = {sweep.floor, sweep.floor};
  plot.series.push_back(std::move(front));
  if (sweep.floor > 0.0) plot.series.push_back(std::move(floor));
  return to_svg(plot);
}

Table table_of(const Sweep& sweep, bool front_only) {
  Table table;
  table.caption = front_only ? "No other setting is both faster and better"
                             : "Every setting; * the method itself calls its bound an estimate";
  table.columns = {{"Method"},
                   {"Setting"},
                   {"Processor time", "s", 3},
                   {"Error", "%", 3},
                   {"Largest", "%", 3},
                   {"Mean bound", "%", 3},
                   {"Bound held"},
                   {"Work"}};
  for (const SweepPoint& p : front_only ? front_of(sweep) : sweep.points)
    table.rows.push_back({p.method, p.setting, p.cpu_s, 100.0 * p.error, 100.0 * p.largest_error,
                          100.0 * p.bound, held_text(p), p.work});
  return table;
}

// What the reference cannot tell apart has not been shown to differ.
Check check_of_reference(const Sweep& sweep) {
  double worst = 0.0;
  for (const SweepPoint& p : sweep.points) worst = std::max(worst, p.error);
  Check check;
  check.name = "the reference tells the settings apart";
  check.measured = sweep.floor / worst;
  check.limit = 1.0;
  check.unit = "of the largest error";
  check.outcome = check.measured <= kClearReference ? Agreement::agrees
                  : check.measured <= 1.0           ? Agreement::warning
                                                    : Agreement::fails;
  check.message = "the reference's own error, as a share of the worst setting's";
  return check;
}

// Promised bounds must hold; estimates are shown and not judged.
std::vector<Check> checks_of(const Sweep& sweep) {
  std::vector<Check> checks = {check_of_reference(sweep)};
  for (const SweepPoint& p : sweep.points) {
    if (!p.bound_is_promised) continue;
    Check check;
    check.name = p.method + ", " + p.setting;
    check.measured = 100.0 * (1.0 - p.bound_held);
    check.limit = 100.0 * (1.0 - kHeldWanted);
    check.unit = "% of the answers outside";
    check.outcome = p.bound_held >= kHeldExpected ? Agreement::agrees
                    : p.bound_held >= kHeldWanted ? Agreement::warning
                                                  : Agreement::fails;
    check.message =
        "answers whose error exceeds the stated bound plus two standard errors of the "
        "reference";
    checks.push_back(std::move(check));
  }
  return checks;
}

std::string joined(const std::vector<std::string>& reasons) {
  std::string text;
  for (const std::string& reason : reasons) text += (text.empty() ? "" : "; ") + reason;
  return text;
}

Report report_of(const Sweep& sweep,
                 const std::vector<std::pair<std::string, std::string>>& provenance) {
  const auto front = front_of(sweep);
  Report report;
  report.title = "Speed against accuracy";
  report.subtitle = sweep.title + ", against " + sweep.reference;
  report.checks = checks_of(sweep);
  report.verdict.outcome = worst_outcome(report.checks);
  const SweepPoint &quick = front.front(), &best = front.back();
  report.verdict.sentence = fmt::format(
      "{} of {} settings are worth taking, from {:.2g} % in {:.2g} s ({}, {}) to {:.2g} % in "
      "{:.2g} s ({}, {}) of processor time.",
      front.size(), sweep.points.size(), 100.0 * quick.error, quick.cpu_s, quick.method,
      quick.setting, 100.0 * best.error, best.cpu_s, best.method, best.setting);
  report.key_numbers = {{"smallest error", 100.0 * best.error, "%", 2, best.method},
                        {"reference's own error", 100.0 * sweep.floor, "%", 2, "k = 1"},
                        {"settings", static_cast<double>(sweep.points.size()), "1",
                         sweep.points.size() < 10    ? 1
                         : sweep.points.size() < 100 ? 2
                                                     : 3,
                         ""}};
  Section trade{"Error against time", {}};
  trade.blocks.push_back(Figure{
      "Error against processor time", as_svg(sweep),
      fmt::format("{}. Down and to the left is better. Below the reference's own error of {:.2g} % "
                  "nothing can be told apart, up to {:.2g} % little.{}",
                  sweep.error_name, 100.0 * sweep.floor, 100.0 * sweep.resolved,
                  sweep.left_out.empty() ? "" : " Left out: " + joined(sweep.left_out) + ".")});
  trade.blocks.push_back(table_of(sweep, true));
  report.sections = {std::move(trade), {"All settings", {table_of(sweep, false)}}};
  for (const auto& [name, value] : provenance) report.provenance.push_back({name, value});
  report.provenance.push_back({"Reference", sweep.reference});
  return report;
}

nlohmann::json point_json(const SweepPoint& p) {
  nlohmann::json json{{"method", p.method},
                      {"setting", p.setting},
                      {"cpu_s", p.cpu_s},
                      {"error", p.error},
                      {"largest_error", p.largest_error},
                      {"bound", p.bound},
                      {"bound_held", p.bound_held},
                      {"bound_is_promised", p.bound_is_promised},
                      {"work", p.work}};
  if (p.matrix_passes) json["matrix_passes"] = *p.matrix_passes;
  return json;
}

}  // namespace

nlohmann::json to_json(const std::vector<SweepPoint>& points) {
  nlohmann::json json = nlohmann::json::array();
  for (const SweepPoint& p : points) json.push_back(point_json(p));
  return json;
}

nlohmann::json shared_json(const Sweep& sweep) {
  return {{"title", sweep.title},
          {"error", sweep.error_name},
          {"reference", sweep.reference},
          {"floor", sweep.floor},
          {"resolved", std::max(sweep.floor, sweep.resolved)},
          {"left_out", sweep.left_out}};
}

void mark_front(std::vector<SweepPoint>& points, double resolved) {
  constexpr double kLeastGain = 0.01;
  std::vector<SweepPoint*> by_time;
  for (SweepPoint& p : points) by_time.push_back(&p);
  std::sort(by_time.begin(), by_time.end(), [](const SweepPoint* a, const SweepPoint* b) {
    return std::tie(a->cpu_s, a->error) < std::tie(b->cpu_s, b->error);
  });
  double best = std::numeric_limits<double>::infinity();
  for (SweepPoint* p : by_time) {
    const double known = std::max(p->error, resolved);
    p->on_front = known < (1.0 - kLeastGain) * best;
    if (p->on_front) best = known;
  }
}

Sweep sweep_of(const RunLedger& ledger) {
  Sweep sweep;
  const nlohmann::json& shared = ledger.shared();
  shared.at("title").get_to(sweep.title);
  shared.at("error").get_to(sweep.error_name);
  shared.at("reference").get_to(sweep.reference);
  shared.at("floor").get_to(sweep.floor);
  sweep.resolved = shared.value("resolved", sweep.floor);
  sweep.left_out = shared.value("left_out", sweep.left_out);
  for (std::size_t job = 0; job < ledger.header().jobs.size(); ++job) {
    if (!ledger.has(job)) continue;
    for (const nlohmann::json& j : ledger.result(job)) {
      SweepPoint p;
      j.at("method").get_to(p.method);
      j.at("setting").get_to(p.setting);
      j.at("cpu_s").get_to(p.cpu_s);
      j.at("error").get_to(p.error);
      j.at("largest_error").get_to(p.largest_error);
      j.at("bound").get_to(p.bound);
      j.at("bound_held").get_to(p.bound_held);
      j.at("bound_is_promised").get_to(p.bound_is_promised);
      j.at("work").get_to(p.work);
      if (j.contains("matrix_passes")) p.matrix_passes = j.at("matrix_passes").get<double>();
      sweep.points.push_back(std::move(p));
    }
  }
  mark_front(sweep.points, sweep.resolved);
  return sweep;
}

int present(const Sweep& sweep, const SweepArguments& a,
            const std::vector<std::pair<std::string, std::string>>& provenance) {
  print(sweep);
  if (!a.json.empty()) write_file_atomically(a.json, as_json(sweep).dump(1) + "\n");
  if (!a.plot.empty()) write_file_atomically(a.plot, as_svg(sweep));
  if (!a.output.empty()) {
    std::filesystem::create_directories(a.output);
    const std::filesystem::path folder = a.output;
    write_report(folder, report_of(sweep, provenance));
    write_file_atomically(folder / "sweep.json", as_json(sweep).dump(1) + "\n");
    fmt::print("{}\n", (folder / "report.html").string());
  }
  return kAgrees;
}

}  // namespace truebox::app
