// Growth and borders on blocks, and which regions stay.
#include <lamina/frontend/depth/plane_regions.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>

#include <lamina/models/polygon.hpp>

namespace lamina {
namespace {
constexpr float kWhole = 64;  // pixels of a whole block, unless blocks are set otherwise

std::size_t at(int i) { return static_cast<std::size_t>(i); }

}  // namespace

void PlaneRegions::start(const BlockImage& blocks, const DisparityGeometry& g,
                         const BlockNoise& noise, double sigmas) {
  blocks_ = &blocks;
  geometry_ = g;
  noise_ = noise;
  gate2_ = static_cast<float>(sigmas * sigmas);
  noise_of_whole_ = static_cast<float>(noise.of_mean(static_cast<double>(kWhole)));
  bend_ = static_cast<float>(2.25 * noise.pixel + noise.shared);
  labels_.assign(blocks.blocks.size(), -1);
  column_.resize(labels_.size());
  for (std::size_t i = 0; i < column_.size(); ++i) {
    column_[i] = static_cast<int>(i % static_cast<std::size_t>(blocks.columns));
  }
  regions_.clear();
}

PlaneRegions::Test PlaneRegions::test_of(const DisparityPlane& plane,
                                         const DisparitySums& sums) const {
  return Test(plane.cast<float>(), sums.covariance(noise_.per_pixel).cast<float>());
}

bool PlaneRegions::fits(const Block& block, const Test& test) const {
  const float r = block.residual(test.plane);
  // A sixty-fourth of anything is exact: whole blocks are spared the divisions.
  const bool whole = block.n == kWhole;
  const auto share = [&block, whole](float x) { return whole ? x * (1 / kWhole) : x / block.n; };
  const float own =
      (whole ? noise_of_whole_ : static_cast<float>(noise_.of_mean(block.n))) + share(test.jitter);
  const Eigen::Vector3f x(block.u, block.v, 1.0F);
  // A young plane predicts badly far away: its own doubt widens the gate, but not without end.
  const float check_match = std::clamp(x.dot(test.covariance * x), 0.0F, 4 * own);
  if (r * r > gate2_ * (own + check_match)) return false;
  const float extra = share(block.sse + block.tilt(test.plane)) - share(block.sse);
  return extra <= bend_;
}

void PlaneRegions::flood(int label, DisparitySums& sums, DisparityPlane& plane) {
  Test test = test_of(plane, sums);
  double next_fit = 1.5 * sums.n;
  const int columns = blocks_->columns, count = static_cast<int>(labels_.size());
  const auto visit = [&](int i) {
    if (labels_[at(i)] != -1) return;
    const Block& block = blocks_->blocks[at(i)];
    if (!block.flat || !fits(block, test)) return;
    labels_[at(i)] = static_cast<std::int16_t>(label);
    sums += block.sums();
    queue_.push_back(i);
    members_.push_back(i);
  };
  for (std::size_t head = 0; head < queue_.size(); ++head) {
    const int i = queue_[head], c = column_[at(i)];
    if (c > 0) visit(i - 1);
    if (c + 1 < columns) visit(i + 1);
    if (i >= columns) visit(i - columns);
    if (i + columns < count) visit(i + columns);
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
  const Test test(plane.cast<float>(), Eigen::Matrix3f::Zero());
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
  split_off_parts(label, min_pixels);
  return label;
}

// The members of the last region that hang together with `start` (corners count); taken off
// `waiting`.
void PlaneRegions::connected(int start, std::vector<std::uint8_t>& waiting) {
  const int columns = blocks_->columns, rows = blocks_->rows;
  queue_.assign(1, start);
  waiting[at(start)] = 0;
  for (std::size_t head = 0; head < queue_.size(); ++head) {
    const int c0 = queue_[head] % columns, r0 = queue_[head] / columns;
    for (int r = std::max(0, r0 - 1); r <= std::min(rows - 1, r0 + 1); ++r) {
      for (int c = std::max(0, c0 - 1); c <= std::min(columns - 1, c0 + 1); ++c) {
        const int i = blocks_->index(c, r);
        if (waiting[at(i)] == 0) continue;
        waiting[at(i)] = 0;
        queue_.push_back(i);
      }
    }
  }
}

// Whether the region is one piece (corners count): its runs along rows, joined where they touch.
bool PlaneRegions::hangs_together(int label) {
  const int columns = blocks_->columns;
  std::vector<Run>& runs = runs_;
  runs.clear();
  const auto root = [&runs](int k) {
    while (runs[at(k)].parent != k) k = runs[at(k)].parent = runs[at(runs[at(k)].parent)].parent;
    return k;
  };
  const auto [lowest, highest] = std::minmax_element(members_.begin(), members_.end());
  int pieces = 0, above = 0, above_end = 0;  // the runs of the row above
  for (int r = *lowest / columns; r <= *highest / columns; ++r) {
    const std::int16_t* const row = labels_.data() + blocks_->index(0, r);
    int near = above;
    const int first = static_cast<int>(runs.size());
    for (int c = 0; c < columns; ++c) {
      if (row[c] != label) continue;
      const int begin = c, mine = static_cast<int>(runs.size());
      while (c < columns && row[c] == label) ++c;
      runs.push_back({begin, c, mine});
      ++pieces;
      while (near < above_end && runs[at(near)].end < begin) ++near;
      for (int k = near; k < above_end && runs[at(k)].begin <= c; ++k) {
        const int a = root(k), b = root(mine);
        pieces -= a != b;
        runs[at(b)].parent = a;
      }
    }
    above = first;
    above_end = static_cast<int>(runs.size());
  }
  return pieces <= 1;
}

// Seeds may lie on several surfaces that one plane happens to hold. Every part large enough to be a
// plane becomes one of its own (merging joins what belongs together); crumbs stay with the first.
void PlaneRegions::split_off_parts(int label, double min_pixels) {
  if (hangs_together(label)) return;
  std::vector<std::uint8_t>& waiting = waiting_;
  waiting.assign(labels_.size(), 0);
  for (const int i : members_) waiting[at(i)] = 1;
  bool first = true;
  for (const int start : members_) {
    if (waiting[at(start)] == 0) continue;
    connected(start, waiting);
    DisparitySums sums;
    for (const int i : queue_) sums += blocks_->blocks[at(i)].sums();
    const auto fit = sums.fit();
    if (!fit || sums.n < min_pixels) continue;
    if (first || regions_.size() >= 254) {
      first = false;
      continue;
    }
    const std::int16_t part = static_cast<std::int16_t>(regions_.size());
    for (const int i : queue_) labels_[at(i)] = part;
    const int count = static_cast<int>(queue_.size());
    regions_.push_back({*fit, sums, count, static_cast<std::int64_t>(sums.n)});
    PlaneRegion& rest = regions_[at(label)];
    rest.sums -= sums;
    rest.blocks -= count;
    rest.pixels = static_cast<std::int64_t>(rest.sums.n);
    rest.plane = rest.sums.fit().value_or(rest.plane);
  }
}

void PlaneRegions::relabel(std::span<const std::int16_t> renamed) {
  for (auto& label : labels_) {
    if (label >= 0) label = renamed[at(label)];
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
    const int columns = blocks_->columns, rows = blocks_->rows;
    for (int r = 0; r < rows; ++r) {
      const std::int16_t* const row = labels_.data() + blocks_->index(0, r);
      const std::int16_t* const above = r > 0 ? row - columns : row;
      const std::int16_t* const below = r + 1 < rows ? row + columns : row;
      for (int c = 0; c < columns; ++c) {
        const std::int16_t mine = row[c];
        // Amid its own kind there is nothing to choose from.
        if (row[std::max(0, c - 1)] == mine && row[std::min(columns - 1, c + 1)] == mine &&
            above[c] == mine && below[c] == mine) {
          continue;
        }
        moved += settle_block(c, r, tests) ? 1 : 0;
      }
    }
    if (moved == 0) break;
    recount();
  }
}

void PlaneRegions::find_rows() {
  extent_.assign(regions_.size(), {blocks_->rows, 0});
  const std::int16_t* label = labels_.data();
  for (int r = 0; r < blocks_->rows; ++r) {
    for (int c = 0; c < blocks_->columns; ++c, ++label) {
      if (*label < 0) continue;
      auto& [first, end] = extent_[at(*label)];
      first = std::min(first, r);
      end = r + 1;
    }
  }
}

// Few blocks with all their neighbours, and much air between the others: a row of posts, a shelf.
bool PlaneRegions::is_scattered(int label) const {
  const int columns = blocks_->columns, rows = blocks_->rows;
  const auto mine = [&](int c, int r) {
    return c >= 0 && r >= 0 && c < columns && r < rows &&
           labels_[at(blocks_->index(c, r))] == label;
  };
  int total = 0, core = 0;
  std::vector<Eigen::Vector2d> corners;
  for (int r = extent_[at(label)].first; r < extent_[at(label)].second; ++r) {
    const std::int16_t* const row = labels_.data() + blocks_->index(0, r);
    int first = columns, end = 0;
    for (int c = 0; c < columns; ++c) {
      if (row[c] != label) continue;
      ++total;
      core += mine(c - 1, r) && mine(c + 1, r) && mine(c, r - 1) && mine(c, r + 1);
      first = std::min(first, c);
      end = c + 1;
    }
    if (end == 0) continue;
    for (const int dv : {0, 1}) {  // only the ends of a row can be corners of the hull
      corners.emplace_back(first, r + dv);
      corners.emplace_back(end, r + dv);
    }
  }
  if (6 * core >= total) return false;
  const auto hull = Polygon::convex_hull(corners);
  return hull && total < 0.4 * hull->area();
}

// One sigma of the normal below two degrees.
bool PlaneRegions::sure_normal(const PlaneRegion& region) const {
  const auto plane = geometry_.plane(region.plane);
  if (!plane) return false;
  const Eigen::Matrix3d C = region.sums.covariance(noise_.per_pixel);
  // d(normal) = |rho| d(N), N = (a fx, b fy, c) / fb.
  const double scale = std::abs(plane->rho()) / geometry_.focal_baseline;
  const double worst =
      scale * scale *
      (C(0, 0) * geometry_.fx * geometry_.fx + C(1, 1) * geometry_.fy * geometry_.fy);
  return worst < 0.035 * 0.035;
}

void PlaneRegions::keep_largest(double min_pixels) {
  std::vector<std::size_t> order(regions_.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [this](std::size_t a, std::size_t b) {
    return regions_[a].sums.n > regions_[b].sums.n;
  });
  std::vector<std::int16_t> renamed(regions_.size(), -1);
  std::vector<PlaneRegion> kept;
  find_rows();
  for (const std::size_t i : order) {
    if (regions_[i].sums.n < std::max(1.0, min_pixels) || !sure_normal(regions_[i])) continue;
    if (regions_[i].blocks < 400 && is_scattered(static_cast<int>(i))) continue;
    renamed[i] = static_cast<std::int16_t>(kept.size());
    kept.push_back(regions_[i]);
  }
  regions_ = std::move(kept);
  relabel(renamed);
}

std::vector<std::int16_t> PlaneRegions::keep(const std::vector<bool>& wanted) {
  std::vector<std::int16_t> renamed(regions_.size(), -1);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < regions_.size(); ++i) {
    if (!wanted[i]) continue;
    renamed[i] = static_cast<std::int16_t>(kept);
    if (kept != i) regions_[kept] = regions_[i];
    ++kept;
  }
  regions_.resize(kept);
  relabel(renamed);
  return renamed;
}

}  // namespace lamina
