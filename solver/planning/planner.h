// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "planning/plan.h"

namespace truebox {

/// How a plan comes about: one decision after the other, each from what the ones before left.
/// For make_plan alone.
class Planner {
 public:
  Planner(const Scene& scene, const PlanRequest& request) : scene_(scene), request_(request) {}

  Plan make();

 private:
  void add(Decision decision) { plan_.decisions.push_back(std::move(decision)); }

  // What kind of light transport it is: plan.cpp.
  void plan_paths();
  void plan_direct();
  void plan_radiosity();
  void decide_method();
  PredictOptions pilot_options() const;
  void fly(const std::optional<Goal>& goal);

  // What elements: plan_mesh.cpp.
  struct MeshChoice {
    double elements = 0.0, uniform_elements = 0.0;  // wanted; of a uniform mesh
    double error = 0.0;                             // foretold bound
    std::string why;
  };
  void decide_mesh();
  void decide_mesh_unforetold();
  void adapt_if_it_pays(const Pilot& uniform, MeshChoice& choice);
  void fit_memory(const Pilot& uniform, MeshChoice& choice);
  void decide_lines();

  // What the radiosity is on an element: plan_basis.cpp.
  struct PolynomialChoice {
    int degree = 0;
    std::size_t pilot_elements = 0;
    double pilot_bound = 0.0;
    double elements = 0.0, unknowns = 0.0, processor_s = 0.0;  // foretold
  };
  std::string why_no_polynomials() const;
  std::optional<PolynomialChoice> fly_polynomials(double patience_s) const;
  bool choose_polynomials();
  void plan_polynomials(const PolynomialChoice& choice, double constants, const std::string& name,
                        const std::string& why);
  void decide_basis();

  // What is kept between them: plan_exchange.cpp.
  void decide_exchange();
  void exchange_by_links(double matrix_bytes, Decision& d);
  bool link_if_it_pays(const Pilot& uniform, MeshChoice& choice);

  // What is worked out between them: plan_transport.cpp.
  void decide_occlusion(double partial, double facing);
  void decide_form_factors();
  void decide_bands(int reduced, double solver_bound);
  void decide_solver();

  bool is_rms() const { return request_.measure == ErrorMeasure::rms_irradiance; }
  const char* error_name() const {
    return is_rms() ? "irradiance, rms over the area, relative to its mean"
                    : "mean irradiance of a surface";
  }
  std::size_t pieces() const;
  double elements_that_fit() const;  // as a matrix
  double least_elements() const;     // that the bound means what it says
  static double pairs(double n) { return 0.5 * n * (n - 1.0); }

  const Scene& scene_;
  const PlanRequest& request_;
  Plan plan_;
  double mesh_error_ = 0.0;
  std::string links_why_, basis_why_;
};

}  // namespace truebox
