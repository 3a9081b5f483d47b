// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "difference/agreement.h"
#include "document/image_set.h"
#include "figures/false_colour.h"

namespace truebox {

// What a report says, as plain values. Whoever has results fills a Report; the writers
// (document/writers.h) turn it into files and escape every text. Units are written as in
// "W m^-2 nm^-1"; "1" or "" is dimensionless.

/// One sentence with a number in it: "The prediction agrees with the photograph: |E_n| <= 0.81."
struct Verdict {
  Agreement outcome = Agreement::not_run;
  std::string sentence;
};

/// One comparison with a limit; verdict, exit code, JUnit and the table of checks come from these.
struct Check {
  std::string name;
  Agreement outcome = Agreement::not_run;
  double measured = 0.0;
  double limit = 0.0;
  std::string unit{};
  std::string message{};          ///< what the number means, or what to do about it
  std::vector<double> earlier{};  ///< measured in the runs before this one, the oldest first
};

/// A number for the row below the verdict.
struct KeyNumber {
  std::string label;
  double value = 0.0;
  std::string unit{};
  int digits = 3;      ///< significant
  std::string note{};  ///< a few words: "limit 1", "k = 2"
};

struct Paragraph {
  std::string text;
};

struct Column {
  std::string name;
  std::string unit{};
  int digits = 4;      ///< significant, or decimals where `fixed`
  bool fixed = false;  ///< a fixed number of decimals, so that the column lines up
};

/// A text or a number, the number perhaps with its standard uncertainty, either perhaps with a
/// mark.
struct Cell {
  std::string text;
  std::optional<double> number;
  std::optional<double> standard_uncertainty;
  std::optional<Agreement> mark;

  Cell() = default;
  Cell(const char* t) : text(t) {}
  Cell(std::string t) : text(std::move(t)) {}
  Cell(double value) : number(value) {}
  Cell(double value, double u) : number(value), standard_uncertainty(u) {}
  Cell(double value, Agreement m) : number(value), mark(m) {}
  Cell(Agreement m) : mark(m) {}
};

struct Table {
  std::string caption{};
  std::vector<Column> columns;
  std::vector<std::vector<Cell>> rows;  ///< as many cells as columns
};

/// A plot made by `figures` (SVG). The caption says what is to be seen.
struct Figure {
  std::string title;
  std::string svg;
  std::string caption{};
};

/// One of several pictures shown side by side. `alt` says in words what the picture shows.
struct Panel {
  std::string title;  ///< "Photograph", "Prediction", "Signed difference"
  Picture picture;
  std::string alt{};
};

/// Pictures of the same pixels; a reader can flip between them in place. With the numbers behind
/// them the page shows those instead where it can run its script: every band, any exposure.
struct PictureRow {
  std::vector<Panel> panels;
  std::string caption{};
  std::optional<ImageSet> image_set{};
};

using Block = std::variant<Paragraph, Table, Figure, PictureRow>;

struct Section {
  std::string title;
  std::vector<Block> blocks;  ///< shown in this order
};

/// One line of the foot: a source, a version, a setting.
struct Setting {
  std::string name;
  std::string value;
};

struct Report {
  std::string title;
  std::string subtitle{};  ///< one line: what was compared with what; says so if data is simulated
  Verdict verdict;
  std::vector<KeyNumber> key_numbers;
  std::vector<Section> sections;
  std::vector<Check> checks;
  std::vector<Setting> provenance;
};

/// The worst outcome; `not_run` if there are no checks, since nothing has then been shown.
Agreement worst_outcome(const std::vector<Check>& checks);

/// 0 agrees, 1 warning, 2 fails or not run: the exit code of a gate.
int exit_code(Agreement outcome);

}  // namespace truebox
