// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "prediction_options.h"

namespace truebox::app {

/// This process as one of those that `mpirun` started.
class Ranks {
 public:
  /// Where this program is not linked with PETSc, becomes the one beside it that is, and starts
  /// again; InputError if there is none.
  explicit Ranks(const std::string& petsc_options);
  ~Ranks();
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;

  bool is_first() const;
  /// Lets the ranks solve together, quietly but for the first, each with its share of the cores.
  void prepare(PredictionArguments& arguments) const;
  /// What every rank fails at alike is told once; what only one fails at ends all of them.
  int guarded(const std::function<int()>& work) const;
  /// Ranks, memory and time, for a person.
  std::string describe() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace truebox::app
