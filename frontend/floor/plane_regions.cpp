// Growth, merging and borders on blocks.
#include <lamina/frontend/floor/plane_regions.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace lamina {
namespace {
std::size_t at(int i) { return static_cast<std::size_t>(i); }
}  // namespace

void PlaneRegions::start(const BlockImage& blocks, const DisparityGeometry& g,
                         const BlockNoise& noise, double sigmas) {
  blocks_ = &blocks;
  geometry_ = g;
  noise_ = noise;
  gate2_ = static_cast<float>(sigmas * sigmas);
  labels_.assign(blocks.blocks.size(), -1);
  regions_.clear();
}

PlaneRegions::Test PlaneRegions::test_of(const DisparityPlane& plane,
                                         const DisparitySums& sums) const {
  return {plane.cast<float>(), sums.covariance(noise_.per_pixel).cast<float>()};
}

bool PlaneRegions::fits(const Block& block, const Test& test) const {
  const float r = block.residual(test.plane);
  const float own = static_cast<float>(noise_.of_mean(block.n));
  const Eigen::Vector3f x(block.u, block.v, 1.0F);
  // A young plane predicts badly far away: its own doubt widens the gate, but not without end.
  const float doubt = std::clamp(x.dot(test.covariance * x), 0.0F, 4 * own);
  if (r * r > gate2_ * (own + doubt)) return false;
  const float extra = block.mean_square(test.plane, 0.0F) - block.sse / block.n;
  return extra <= static_cast<float>(2.25 * noise_.pixel + noise_.shared);
}

void PlaneRegions::flood(int label, DisparitySums& sums, DisparityPlane& plane) {
  Test test = test_of(plane, sums);
  double next_fit = 1.5 * sums.n;
  const int columns = blocks_->columns, rows = blocks_->rows;
  const auto visit = [&](int c, int r) {
    if (c < 0 || r < 0 || c >= columns || r >= rows) return;
    const int i = blocks_->index(c, r);
    const Block& block = blocks_->blocks[at(i)];
    if (!block.flat || labels_[at(i)] != -1 || !fits(block, test)) return;
    labels_[at(i)] = static_cast<std::int16_t>(label);
    sums += block.sums();
    queue_.push_back(i);
    members_.push_back(i);
  };
  for (std::size_t head = 0; head < queue_.size(); ++head) {
    const int c = queue_[head] % columns, r = queue_[head] / columns;
    visit(c - 1, r);
    visit(c + 1, r);
    visit(c, r - 1);
    visit(c, r + 1);
    if (sums.n < next_fit) continue;
    next_fit = 1.5 * sums.n;
    if (const auto fit = sums.fit()) {
      plane = *fit;
      test = test_of(plane, sums);
    }
  }
}

// Fits once more and sets free who no longer belongs. True when somebody left or the plane moved
// enough to be worth another flood.
bool PlaneRegions::refit_members(int label, DisparitySums& sums, DisparityPlane& plane) {
  const auto fit = sums.fit();
  if (!fit) return false;
  plane = *fit;
  const Test test = test_of(plane, sums);
  std::size_t kept = 0;
  for (const int i : members_) {
    const Block& block = blocks_->blocks[at(i)];
    if (fits(block, test)) {
      members_[kept++] = i;
    } else {
      labels_[at(i)] = -1;
      sums -= block.sums();
    }
  }
  const bool left = kept < members_.size();
  members_.resize(kept);
  if (const auto again = sums.fit(); left && again) plane = *again;
  (void)label;
  return left;
}

int PlaneRegions::grow(std::span<const int> seeds, const DisparityPlane& start_plane,
                       double min_pixels) {
  if (regions_.size() >= 254) return -1;  // labels of pixels are bytes
  const int label = static_cast<int>(regions_.size());
  DisparitySums sums;
  DisparityPlane plane = start_plane;
  queue_.clear();
  members_.clear();
  Test test{plane.cast<float>(), Eigen::Matrix3f::Zero()};
  for (const int i : seeds) {
    const Block& block = blocks_->blocks[at(i)];
    if (!block.flat || labels_[at(i)] != -1 || !fits(block, test)) continue;
    labels_[at(i)] = static_cast<std::int16_t>(label);
    sums += block.sums();
    queue_.push_back(i);
    members_.push_back(i);
  }
  if (const auto fit = sums.fit()) plane = *fit;
  flood(label, sums, plane);
  for (int round = 0; round < 2 && refit_members(label, sums, plane); ++round) {
    queue_ = members_;
    flood(label, sums, plane);
  }
  const auto fit = sums.fit();
  if (!fit || sums.n < min_pixels) {
    for (const int i : members_) labels_[at(i)] = -1;
    return -1;
  }
  regions_.push_back(
      {*fit, sums, static_cast<int>(members_.size()), static_cast<std::int64_t>(sums.n)});
  return label;
}

std::optional<double> PlaneRegions::merge_cost(const PlaneRegion& a, const PlaneRegion& b) const {
  DisparitySums both = a.sums;
  both += b.sums;
  const auto fit = both.fit();
  if (!fit) return std::nullopt;
  double worst = 0;
  for (const PlaneRegion* r : {&a, &b}) {
    // Three parameters of its own: their noise is 3 / n of a pixel's.
    const double allowed = gate2_ * (3 * noise_.per_pixel / r->sums.n + noise_.shared);
    worst = std::max(worst, r->sums.mean_square(r->plane - *fit) / allowed);
  }
  return worst <= 1 ? std::optional<double>(worst) : std::nullopt;
}

void PlaneRegions::relabel(std::int16_t from, std::int16_t to) {
  for (auto& label : labels_) {
    if (label == from) label = to;
  }
}

void PlaneRegions::merge() {
  std::vector<bool> gone(regions_.size(), false);
  for (;;) {
    std::size_t first = 0, second = 0;
    double best = 2;
    for (std::size_t i = 0; i < regions_.size(); ++i) {
      for (std::size_t j = i + 1; j < regions_.size() && !gone[i]; ++j) {
        if (gone[j]) continue;
        const auto cost = merge_cost(regions_[i], regions_[j]);
        if (cost && *cost < best) {
          best = *cost;
          first = i;
          second = j;
        }
      }
    }
    if (best > 1) break;
    PlaneRegion& a = regions_[first];
    a.sums += regions_[second].sums;
    a.blocks += regions_[second].blocks;
    a.pixels += regions_[second].pixels;
    a.plane = a.sums.fit().value_or(a.plane);
    gone[second] = true;
    regions_[second] = PlaneRegion();
    relabel(static_cast<std::int16_t>(second), static_cast<std::int16_t>(first));
  }
}

bool PlaneRegions::settle_block(int c, int r, std::span<const Test> tests) {
  const int i = blocks_->index(c, r);
  const Block& block = blocks_->blocks[at(i)];
  if (!block.flat) return false;
  const std::int16_t mine = labels_[at(i)];
  std::int16_t best = mine;
  float best_cost =
      mine >= 0 ? block.mean_square(tests[at(mine)].plane, block.residual(tests[at(mine)].plane))
                : 1e30F;
  const auto consider = [&](int cc, int rr) {
    if (cc < 0 || rr < 0 || cc >= blocks_->columns || rr >= blocks_->rows) return;
    const std::int16_t other = labels_[at(blocks_->index(cc, rr))];
    if (other < 0 || other == best) return;
    const Test& test = tests[at(other)];
    if (!fits(block, test)) return;
    const float cost = block.mean_square(test.plane, block.residual(test.plane));
    if (cost < best_cost) {
      best_cost = cost;
      best = other;
    }
  };
  consider(c - 1, r);
  consider(c + 1, r);
  consider(c, r - 1);
  consider(c, r + 1);
  labels_[at(i)] = best;
  return best != mine;
}

void PlaneRegions::recount() {
  for (PlaneRegion& region : regions_) {
    region.sums = DisparitySums();
    region.blocks = 0;
  }
  for (std::size_t i = 0; i < labels_.size(); ++i) {
    if (labels_[i] < 0) continue;
    PlaneRegion& region = regions_[at(labels_[i])];
    region.sums += blocks_->blocks[i].sums();
    ++region.blocks;
  }
  for (PlaneRegion& region : regions_) {
    region.plane = region.sums.fit().value_or(region.plane);
    region.pixels = static_cast<std::int64_t>(region.sums.n);
  }
}

void PlaneRegions::settle_borders(int passes) {
  for (int pass = 0; pass < passes; ++pass) {
    std::vector<Test> tests;
    for (const PlaneRegion& region : regions_) tests.push_back(test_of(region.plane, region.sums));
    int moved = 0;
    for (int r = 0; r < blocks_->rows; ++r) {
      for (int c = 0; c < blocks_->columns; ++c) moved += settle_block(c, r, tests) ? 1 : 0;
    }
    if (moved == 0) break;
    recount();
  }
}

void PlaneRegions::keep_largest(double min_pixels) {
  std::vector<std::size_t> order(regions_.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [this](std::size_t a, std::size_t b) {
    return regions_[a].sums.n > regions_[b].sums.n;
  });
  std::vector<std::int16_t> renamed(regions_.size(), -1);
  std::vector<PlaneRegion> kept;
  for (const std::size_t i : order) {
    if (regions_[i].sums.n < std::max(1.0, min_pixels)) continue;
    renamed[i] = static_cast<std::int16_t>(kept.size());
    kept.push_back(regions_[i]);
  }
  regions_ = std::move(kept);
  for (auto& label : labels_) {
    if (label >= 0) label = renamed[at(label)];
  }
}

}  // namespace lamina
