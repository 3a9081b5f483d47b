// SPDX-License-Identifier: BSD-3-Clause
#include "ranks.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <vector>

#include "commands.h"
#include "radiometry/input_error.h"
#ifdef TRUEBOX_WITH_PETSC
#include "distributed/distributed_run.h"
#endif

namespace truebox::app {

#ifdef TRUEBOX_WITH_PETSC

struct Ranks::State {
  explicit State(const std::string& petsc_options) : run(petsc_options) {}
  DistributedRun run;
};

Ranks::Ranks(const std::string& petsc_options) : state_(std::make_unique<State>(petsc_options)) {}

bool Ranks::is_first() const { return state_->run.rank() == 0; }

void Ranks::prepare(PredictionArguments& arguments) const {
  if (arguments.method != "krylov" || arguments.sensitivities)
    throw InputError("--distributed", 0, "PETSc's method (--petsc-options)",
                     arguments.sensitivities ? "--sensitivities" : "--method");
  arguments.solve_grid = state_->run.solve_grid();
  arguments.error_shares = false;
  arguments.form_factors = "exact-visibility";
  arguments.quiet |= !is_first();
  if (arguments.threads == 0)
    arguments.threads =
        std::max(1, static_cast<int>(std::thread::hardware_concurrency()) / state_->run.size());
}

int Ranks::guarded(const std::function<int()>& work) const {
  try {
    return work();
  } catch (const InputError&) {
    if (is_first()) throw;
    return kUnreadable;
  } catch (const std::length_error&) {
    if (is_first()) throw;
    return kNotSolved;
  } catch (const std::exception& error) {
    fmt::print(stderr, "truebox: rank {} of {}: {}\n", state_->run.rank(), state_->run.size(),
               error.what());
    state_->run.abort(kNotSolved);
  }
}

std::string Ranks::describe() const {
  const DistributedTimes& times = state_->run.times();
  return fmt::format(
      "  {} ranks: at most {:.1f} MiB of form factors on one; form factors {:.2f} s, PETSc {:.2f} "
      "s "
      "on the slowest\n",
      state_->run.size(), static_cast<double>(times.rows_bytes) / 1048576.0, times.form_factors_s,
      times.solve_s);
}

#else

namespace {

// Becomes the program beside this one that is linked with PETSc and MPI; returns if there is none.
void become_the_distributed_program() {
  std::ifstream file("/proc/self/cmdline", std::ios::binary);
  const std::string line{std::istreambuf_iterator<char>(file), {}};
  std::vector<std::string> arguments;
  for (std::size_t at = 0; at < line.size(); at = line.find('\0', at) + 1)
    arguments.emplace_back(line.c_str() + at);
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  std::error_code none;
  const auto self = std::filesystem::read_symlink("/proc/self/exe", none);
  ::execv((self.parent_path() / "truebox-distributed").c_str(), argv.data());
}

}  // namespace

struct Ranks::State {};

Ranks::Ranks(const std::string&) {
  become_the_distributed_program();
  throw InputError("--distributed", 0, "a program built with PETSc and MPI",
                   "none (install libpetsc-real-dev and configure again)");
}
bool Ranks::is_first() const { return true; }
void Ranks::prepare(PredictionArguments&) const {}
int Ranks::guarded(const std::function<int()>& work) const { return work(); }
std::string Ranks::describe() const { return {}; }

#endif

Ranks::~Ranks() = default;

}  // namespace truebox::app
