// SPDX-License-Identifier: BSD-3-Clause
// What is kept between elements.
#include <algorithm>
#include <cmath>

#include "hierarchy/hierarchical_exchange.h"
#include "planning/plan_text.h"
#include "planning/planner.h"

namespace truebox {

using plan_text::count;
using plan_text::mebibytes;
using plan_text::percent;
using plan_text::seconds;

namespace {

constexpr double kCoarseLinks = 0.1, kFineLinks = 1e-2;
// Measured by tests/benchmark/links_or_matrix.cpp, see solver/README.md: the size that links need,
// and how their time grows.
constexpr double kLinksPayFrom = 5500.0;
constexpr double kLinksByElements = 0.55, kLinksByTolerance = 0.8;
constexpr double kMeshShare = 0.8;  // of the error that is asked for
constexpr std::size_t kLinkPilotElements = 2000;

}  // namespace

void Planner::decide_exchange() {
  const double n = static_cast<double>(plan_.elements);
  const double matrix_bytes = n * n * sizeof(double);
  Decision d{"exchange", "", ""};
  d.work = "MiB";
  d.full_work = matrix_bytes / (1 << 20);
  if (plan_.exchange == PlannedExchange::hierarchical) {
    exchange_by_links(matrix_bytes, d);
  } else if (matrix_bytes <= static_cast<double>(request_.memory_limit_bytes)) {
    plan_.bytes = static_cast<std::size_t>(matrix_bytes);
    d.choice = "full matrix, " + mebibytes(matrix_bytes);
    d.why = "fits the limit of " + mebibytes(static_cast<double>(request_.memory_limit_bytes)) +
            ", and its bound is one; that of links is an estimate" + links_why_;
    d.planned_work = d.full_work;
  } else if (plan_.exchange == PlannedExchange::streamed) {
    plan_.bytes = static_cast<std::size_t>(3.0 * n * sizeof(double) *
                                           static_cast<double>(scene_.bands.size()));
    d.choice = "streamed: rows made anew for each pass, about " +
               mebibytes(static_cast<double>(plan_.bytes));
    d.why = "a matrix takes " + mebibytes(matrix_bytes) + ", above the limit of " +
            mebibytes(static_cast<double>(request_.memory_limit_bytes)) +
            "; without it the passes take " + seconds(plan_.processor_s) +
            ", and the bound stays one";
    d.left_out = "the matrix";
    d.planned_work = static_cast<double>(plan_.bytes) / (1 << 20);
  } else {
    exchange_by_links(matrix_bytes, d);
  }
  add(std::move(d));
}

void Planner::exchange_by_links(double matrix_bytes, Decision& d) {
  if (plan_.exchange != PlannedExchange::hierarchical) {
    plan_.exchange = PlannedExchange::hierarchical;
    plan_.mesh = PlannedMesh::uniform;
    plan_.processor_s = 0.0;  // the pilot's law is that of a matrix
    // Without a pilot nobody knows what finer links are worth beside the grid's own error.
    plan_.link_tolerance =
        plan_.pilot ? std::clamp(request_.target_error, kFineLinks, kCoarseLinks) : kCoarseLinks;
    d.why = "a matrix takes " + mebibytes(matrix_bytes) + ", above the limit of " +
            mebibytes(static_cast<double>(request_.memory_limit_bytes));
  } else {
    d.why = links_why_;
  }
  HierarchyOptions options{plan_.link_tolerance, request_.memory_limit_bytes};
  if (estimated_bytes(plan_.elements, options) > request_.memory_limit_bytes)
    plan_.link_tolerance = options.relative_tolerance = kCoarseLinks;
  plan_.bytes = estimated_bytes(plan_.elements, options);
  d.choice = "hierarchical, links of " + percent(plan_.link_tolerance) + ", about " +
             mebibytes(static_cast<double>(plan_.bytes));
  d.left_out = "what is too faint to be worth a link of its own";
  d.planned_work = static_cast<double>(plan_.bytes) / (1 << 20);
  d.error_kind = ErrorKind::estimate;
  d.error = plan_.link_tolerance;
  d.error_of = "irradiance, rms over the area";
}

// At equal error of the whole answer, on uniform elements: where a search for the mesh comes first,
// links save little of the whole. Links may be as wrong as asked for: what they leave out is then
// somewhat less than the error of their elements, of which there are a few more than a matrix would
// need, and the two are independent.
bool Planner::link_if_it_pays(const Pilot& uniform, MeshChoice& choice) {
  if (choice.uniform_elements < kLinksPayFrom) {
    links_why_ = "; links take longer below some " + count(kLinksPayFrom) + " elements";
    return false;
  }
  const double target = request_.target_error;
  const double linked = std::max(uniform.elements_for(kMeshShare * target), least_elements());
  const HierarchyOptions hierarchy{target, request_.memory_limit_bytes};
  if (estimated_bytes(static_cast<std::size_t>(std::min(linked, 1e9)), hierarchy) >
      hierarchy.memory_limit_bytes) {
    links_why_ = "; links of " + percent(target) + " may not fit";
    return false;
  }
  PredictOptions options = pilot_options();
  options.elements = std::max<std::size_t>(kLinkPilotElements, options.elements);
  options.find_exchange = hierarchical_exchange(hierarchy);
  const Pilot links = fly_single_pilot(scene_, options);
  const double links_s =
      links.processor_s * std::pow(linked / static_cast<double>(links.elements), kLinksByElements);
  // Where the two laws meet: links of a mesh's own error grow with the tolerance as well.
  const double uniform_s = uniform.processor_s_for(choice.uniform_elements);
  const double power =
      uniform.cost_exponent - kLinksByElements - kLinksByTolerance * uniform.error_order;
  const double meet = choice.uniform_elements * std::pow(links_s / uniform_s, 1.0 / power);
  std::string why = count(linked) + " even elements with links of " + percent(target) + " take " +
                    seconds(links_s) + ", a matrix of " + count(choice.uniform_elements) +
                    " for the same error " + seconds(uniform_s) + ": links are sooner from " +
                    count(std::max(kLinksPayFrom, meet)) + " elements of such a matrix on";
  const bool is_adapted = plan_.mesh == PlannedMesh::adapted;
  const double matrix_s = plan_.pilot->processor_s_for(choice.elements);
  if (is_adapted) why += "; a matrix of adapted elements takes " + seconds(matrix_s);
  if (choice.elements <= elements_that_fit() && links_s >= matrix_s) {
    links_why_ = "; " + why;
    return false;
  }
  links_why_ = why;
  plan_.exchange = PlannedExchange::hierarchical;
  plan_.mesh = PlannedMesh::uniform;
  plan_.pilot = uniform;
  plan_.link_tolerance = target;
  plan_.processor_s = links_s;
  choice.elements = linked;
  return true;
}

}  // namespace truebox
