// SPDX-License-Identifier: BSD-3-Clause
#include "hierarchy/hierarchical_exchange.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <iterator>
#include <stdexcept>
#include <tuple>

#include "hierarchy/linked_exchange.h"
#include "transport/enclosure.h"
#include "transport/solve_radiosity.h"

namespace truebox {
namespace {

using Eigen::Index;

constexpr int kRounds = 4;
constexpr double kFirstShare = 0.1;  // of the tolerance: the first links are to be few
constexpr double kFirstOrder = 0.6;  // what links leave out, by powers of what each may
constexpr double kAim = 0.8;         // of the tolerance
constexpr double kLargestStep = 1.0 / 256, kSmallestStep = 0.5;  // of a link's error, each round
// At a tolerance of 1e-2: one room 10, a museum's 20; at 1e-3 118, at 0.1 2.5.
constexpr double kLinksOfAnElement = 30.0;
constexpr std::size_t kBytesOfAnElement = 5200;  // tree, points and moments, kernels, a product
constexpr std::size_t kBytesOfPoints = 2 * sizeof(GroupSamples) + 29 * 4 * sizeof(double);
constexpr std::size_t kBytesOfALink = 65;  // of all degrees together
constexpr std::size_t kCopies = 2;  // of links, at most: lists joined, those of elements kept
constexpr double kMostKernelTolerance = 1e-2, kKernelShare = 0.03;  // of the links' tolerance
constexpr double kStalled = 0.8;  // of the last estimate: what is left is between single elements
constexpr double kCloseEnough = 0.02;  // of the tolerance, while rounds follow
constexpr double kLeastRow = 0.1;      // rows that hold less than this are not scaled up to 1

double processor_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

std::string mebibytes(double bytes) {
  return std::to_string(static_cast<std::size_t>(bytes / (1 << 20))) + " MiB";
}

class Finder {
 public:
  Finder(const HierarchyOptions& options, const ExchangeRequest& request)
      : options_(options), request_(request), area_(static_cast<Index>(request.mesh.size())) {
    for (Index i = 0; i < area_.size(); ++i)
      area_[i] = request.mesh.patches[static_cast<std::size_t>(i)].area_m2;
  }

  FoundExchange find() {
    const double start_s = processor_s();
    const auto groups = std::make_shared<const GroupBasis>(request_.mesh, usable_tree());
    const LinkRefinement refinement(
        request_.mesh, request_.visibility, *groups, request_.culling,
        std::min(kMostKernelTolerance, kKernelShare * options_.relative_tolerance),
        request_.options.seed);
    // First links: light as if spread evenly. Each round knows the light that the last one found.
    const double tolerance = options_.relative_tolerance;
    double of_a_link = kFirstShare * tolerance;
    BandMatrix radiosity = ambient_guess(), irradiance, last;
    double worth = 1.0, last_estimate = 0.0, order = kFirstOrder;
    LinkCounts counts;
    std::vector<Link> known;
    std::size_t total = 0;
    double step = 1.0;
    LinkedExchange* last_exchange = nullptr;
    test_enclosure();
    for (int round = 0; round < kRounds; ++round) {
      found_.exchange.reset();
      Links links = refine(refinement, groups->tree, radiosity, of_a_link, known);
      counts = links.counts;
      total = links.size();
      std::vector<Link> of_elements = links_of_elements(groups->tree, links);
      auto exchange = std::make_unique<LinkedExchange>(groups, area_, std::move(links));
      close(*exchange, groups->bytes(), kCloseEnough * tolerance);
      radiosity = solved(*exchange, irradiance);
      last_exchange = exchange.get();
      found_.exchange = std::move(exchange);
      const double estimate = std::sqrt(counts.sum_of_squares);
      if (last_estimate > 0.0)
        worth = std::max(1.0, relative_difference(last, irradiance) / last_estimate);
      if (round > 0 && (worth * estimate <= tolerance || estimate > kStalled * last_estimate))
        break;
      if (last_estimate > estimate && estimate > 0.0)
        order = std::clamp(std::log(last_estimate / estimate) / std::log(1.0 / step), 0.4, 1.0);
      last = irradiance;
      last_estimate = estimate;
      known = std::move(of_elements);
      const double wanted = estimate > 0.0 ? kAim * tolerance / (worth * estimate) : 1.0;
      step = std::clamp(std::pow(wanted, 1.0 / order), kLargestStep, kSmallestStep);
      of_a_link *= step;
    }
    finish_closing(*last_exchange);
    FormFactorSummary& summary = found_.summary;
    summary.rays = counts.rays;
    summary.pairs_hidden = counts.hidden;
    summary.pairs_sampled = counts.sampled;
    summary.pairs_unoccluded = total - std::min(total, counts.sampled);
    found_.links = LinkSummary{request_.mesh.size(),
                               total,
                               counts.tried,
                               counts.hidden,
                               bytes_,
                               processor_s() - start_s,
                               tolerance,
                               worth * std::sqrt(counts.sum_of_squares)};
    return std::move(found_);
  }

 private:
  ElementTree usable_tree() {
    const PatchMesh& mesh = request_.mesh;
    found_.usable =
        usable_patches(mesh, request_.scene, request_.visibility, request_.options.seed);
    std::vector<std::uint32_t> patches;
    for (std::uint32_t i = 0; i < mesh.size(); ++i)
      if (found_.usable[i]) patches.push_back(i);
    found_.summary.buried_patches = mesh.size() - patches.size();
    if (patches.empty()) patches.push_back(0);
    return element_tree(mesh, std::move(patches));
  }

  // Each band's flux, spread evenly: B = M + rho E with E = mean(M) / (1 - mean(rho)).
  BandMatrix ambient_guess() const {
    const Eigen::RowVectorXd source = area_.transpose() * request_.source / area_.sum();
    const Eigen::RowVectorXd rho = area_.transpose() * request_.rho / area_.sum();
    const Eigen::RowVectorXd irradiance = source.array() / (1.0 - rho.array());
    return request_.source + request_.rho * irradiance.asDiagonal();
  }

  Links refine(const LinkRefinement& refinement, const ElementTree& tree,
               const BandMatrix& radiosity, double of_a_link, std::span<const Link> known) const {
    LinkOptions options;
    options.error_of_a_link = of_a_link;
    options.rays = request_.options.rays;
    options.most_degree = options_.most_degree;
    options.seed = request_.options.seed;
    options.progress = request_.options.progress;
    const std::size_t others = request_.mesh.size() * kBytesOfAnElement;
    options.most_bytes =
        (options_.memory_limit_bytes - std::min(options_.memory_limit_bytes, others)) / kCopies;
    const Eigen::VectorXd mean = (area_.transpose() * radiosity / area_.sum()).transpose();
    try {
      return refinement.refine(node_light(tree, area_, radiosity, mean), options, known);
    } catch (const std::length_error& error) {
      throw std::length_error(
          std::to_string(request_.mesh.size()) + " elements with a link tolerance of " +
          std::to_string(options_.relative_tolerance) + " need " + error.what() +
          ", which is all " + mebibytes(static_cast<double>(options_.memory_limit_bytes)) +
          " hold; a tolerance twice as large takes about half of the links");
    }
  }

  // Sorted, as the next refinement wants them.
  static std::vector<Link> links_of_elements(const ElementTree& tree, const Links& links) {
    std::vector<Link> found;
    std::copy_if(links.links.begin(), links.links.end(), std::back_inserter(found),
                 [&](const Link& link) {
                   return tree.nodes[link.a].is_leaf() && tree.nodes[link.b].is_leaf();
                 });
    std::sort(found.begin(), found.end(),
              [](const Link& x, const Link& y) { return std::tie(x.a, x.b) < std::tie(y.a, y.b); });
    return found;
  }

  BandMatrix solved(const ExchangeOperator& exchange, BandMatrix& irradiance) const {
    SolveOptions options;
    options.relative_bound = 0.1 * options_.relative_tolerance;
    options.iteration_limit = 200;
    BandMatrix radiosity;
    solve_radiosity(exchange, request_.rho, request_.source, options, radiosity, {}, &irradiance);
    return radiosity;
  }

  // Root mean square over the area, relative to the mean; worst band.
  double relative_difference(const BandMatrix& a, const BandMatrix& b) const {
    double worst = 0.0;
    for (Index k = 0; k < a.cols(); ++k) {
      const double mean = area_.dot(b.col(k)) / area_.sum();
      if (mean > 0.0)
        worst = std::max(
            worst, std::sqrt(area_.dot((a.col(k) - b.col(k)).cwiseAbs2()) / area_.sum()) / mean);
    }
    return worst;
  }

  void test_enclosure() {
    const ClosureTest closure = test_closure(request_.mesh, request_.scene, request_.visibility,
                                             found_.usable, request_.options.seed);
    found_.summary.closed = closure.closed;
    found_.summary.closure_rays = closure.rays;
  }

  // Rows that sum to 1 in a closed scene, to no more than 1 in an open one.
  void close(LinkedExchange& exchange, std::size_t bytes_of_groups, double accuracy) {
    FormFactorSummary& summary = found_.summary;
    bytes_ = exchange.bytes() + bytes_of_groups + request_.mesh.size() * kBytesOfPoints;
    const Eigen::VectorXd rows = exchange.row_sums();
    double weighted = 0.0, total = 0.0;
    summary.closure_error_max = 0.0;
    for (Index i = 0; i < rows.size(); ++i) {
      if (!found_.usable[static_cast<std::size_t>(i)]) continue;
      const double error = std::abs(rows[i] - 1.0);
      summary.closure_error_max = std::max(summary.closure_error_max, error);
      weighted += error * area_[i];
      total += area_[i];
    }
    summary.closure_error_mean = weighted / total;
    const auto repair = exchange.close_rows(kLeastRow, summary.closed, accuracy);
    summary.repair_max = repair.largest_change;
  }

  // To the last digit, where the links are the last.
  void finish_closing(LinkedExchange& exchange) {
    FormFactorSummary& summary = found_.summary;
    const auto repair = exchange.close_rows(kLeastRow, summary.closed);
    summary.closure_residual_max = repair.residual_max;
    summary.row_sum_max = exchange.row_sum_max();
  }

  const HierarchyOptions& options_;
  const ExchangeRequest& request_;
  Eigen::VectorXd area_;
  FoundExchange found_;
  std::size_t bytes_ = 0;
};

}  // namespace

std::string HierarchyOptions::invalid() const {
  if (!(relative_tolerance > 0.0 && relative_tolerance < 1.0))
    return "the links' relative tolerance must lie in (0, 1)";
  return {};
}

std::size_t estimated_bytes(std::size_t elements, const HierarchyOptions& options) {
  const double links = std::min(0.5 * static_cast<double>(elements),
                                kLinksOfAnElement * 1e-2 / options.relative_tolerance);
  return static_cast<std::size_t>(static_cast<double>(elements) *
                                  (kBytesOfAnElement + links * kBytesOfALink * kCopies));
}

void require_memory(std::size_t elements, const HierarchyOptions& options) {
  const std::size_t bytes = estimated_bytes(elements, options);
  if (bytes <= options.memory_limit_bytes) return;
  const double fits = static_cast<double>(elements) *
                      static_cast<double>(options.memory_limit_bytes) / static_cast<double>(bytes);
  throw std::length_error(std::to_string(elements) + " elements and their links need about " +
                          mebibytes(static_cast<double>(bytes)) + ", the limit is " +
                          mebibytes(static_cast<double>(options.memory_limit_bytes)) +
                          "; that fits about " + std::to_string(static_cast<std::size_t>(fits)) +
                          " elements at this link tolerance");
}

FindExchange hierarchical_exchange(const HierarchyOptions& options) {
  if (const std::string why = options.invalid(); !why.empty()) throw std::invalid_argument(why);
  return [options](const ExchangeRequest& request) { return Finder(options, request).find(); };
}

}  // namespace truebox
