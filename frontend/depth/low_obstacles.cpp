// Raised and sunk cells.
#include <lamina/frontend/depth/low_obstacles.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace lamina {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
// Taller things are walls and boxes: they say nothing about the floor beside them.
constexpr float kBand = 0.1F;

float median(std::vector<float>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

class Detector {
 public:
  Detector(const EvidenceGrid& grid, const FloorOptions& options)
      : grid_(grid),
        options_(options),
        residual_(grid.cells.size(), kNan),
        score_(grid.cells.size(), 0),
        error_(grid.cells.size(), 0) {}

  std::vector<LowObstacle> run() {
    take_off_local_floor();
    smooth();
    widen_by_empirical_null();
    return connect();
  }
  std::vector<float>& residuals() { return residual_; }
  LocalFloor& local_floor() { return local_; }

 private:
  bool seen(const CellEvidence& c) const { return c.information > 0; }

  // One node: the median of the cells around it, when there are enough to have one.
  LocalFloor::Node local_floor(int i0, int j0, int radius) {
    scratch_.clear();
    for (int i = std::max(0, i0 - radius); i <= std::min(grid_.nx - 1, i0 + radius); i += 2) {
      for (int j = std::max(0, j0 - radius); j <= std::min(grid_.ny - 1, j0 + radius); ++j) {
        const CellEvidence& c = grid_.cells[grid_.index(i, j)];
        if (seen(c) && std::abs(c.height) < kBand) scratch_.push_back(c.height);
      }
    }
    if (scratch_.size() < 24) return {};
    return {median(scratch_), true};
  }

  void take_off_local_floor() {
    const int radius = std::max(2, static_cast<int>(options_.local_floor_m / grid_.cell_m));
    const int step = std::max(1, radius / 2);
    const int mx = grid_.nx / step + 2, my = grid_.ny / step + 2;
    local_.rows = my;
    local_.step = step;
    local_.nodes.assign(static_cast<std::size_t>(mx * my), {});
    for (int a = 0; a < mx; ++a) {
      for (int b = 0; b < my; ++b) {
        local_.nodes[static_cast<std::size_t>(a * my + b)] =
            local_floor(a * step, b * step, radius);
      }
    }
    for (int i = 0; i < grid_.nx; ++i) {
      for (int j = 0; j < grid_.ny; ++j) {
        const std::size_t k = grid_.index(i, j);
        if (!seen(grid_.cells[k])) continue;
        residual_[k] = grid_.cells[k].height - local_.at(i, j);
      }
    }
  }

  // Means over 3 x 3 cells.
  void smooth() {
    for (int i = 0; i < grid_.nx; ++i) {
      for (int j = 0; j < grid_.ny; ++j) {
        const std::size_t k = grid_.index(i, j);
        const CellEvidence& center = grid_.cells[k];
        if (!seen(center) || std::abs(residual_[k]) > kBand) continue;
        float sum = 0, information = 0;
        for (int a = std::max(0, i - 1); a <= std::min(grid_.nx - 1, i + 1); ++a) {
          for (int b = std::max(0, j - 1); b <= std::min(grid_.ny - 1, j + 1); ++b) {
            const std::size_t m = grid_.index(a, b);
            const CellEvidence& c = grid_.cells[m];
            if (!seen(c) || std::abs(residual_[m]) > kBand) continue;
            sum += c.information * residual_[m];
            information += c.information;
          }
        }
        error_[k] = std::sqrt(1 / information + center.shared_variance);
        score_[k] = sum / information / error_[k];
      }
    }
  }

  void widen_by_empirical_null() {
    constexpr float kBandWidth = 1.25F;  // m of range
    for (int band = 0; band < 8; ++band) {
      const float low = kBandWidth * static_cast<float>(band);
      std::vector<std::size_t> members;
      scratch_.clear();
      for (std::size_t k = 0; k < score_.size(); ++k) {
        const float range = grid_.cells[k].range;
        if (error_[k] <= 0 || range < low || range >= low + kBandWidth) continue;
        members.push_back(k);
        scratch_.push_back(std::abs(score_[k]));
      }
      if (scratch_.size() < 30) continue;
      const float spread = 1.4826F * median(scratch_);
      if (spread <= 1) continue;
      for (const std::size_t k : members) {
        error_[k] *= spread;
        score_[k] /= spread;
      }
    }
  }

  std::vector<LowObstacle> connect() {
    tests_ = 0;
    for (const float e : error_) tests_ += e > 0 ? 1 : 0;
    std::vector<LowObstacle> found;
    if (tests_ == 0) return found;
    const float limit =
        static_cast<float>(normal_threshold(options_.false_alarm / static_cast<double>(tests_)));
    std::vector<bool> done(score_.size(), false);
    for (int i = 0; i < grid_.nx; ++i) {
      for (int j = 0; j < grid_.ny; ++j) {
        const std::size_t k = grid_.index(i, j);
        if (done[k] || std::abs(score_[k]) < limit) continue;
        if (auto obstacle = flood(i, j, limit, done)) found.push_back(std::move(*obstacle));
      }
    }
    return found;
  }

  std::optional<LowObstacle> flood(int i0, int j0, float limit, std::vector<bool>& done) {
    const bool raised = score_[grid_.index(i0, j0)] > 0;
    std::vector<std::pair<int, int>> cells{{i0, j0}};
    done[grid_.index(i0, j0)] = true;
    for (std::size_t head = 0; head < cells.size(); ++head) {
      const auto [ci, cj] = cells[head];
      for (int i = std::max(0, ci - 1); i <= std::min(grid_.nx - 1, ci + 1); ++i) {
        for (int j = std::max(0, cj - 1); j <= std::min(grid_.ny - 1, cj + 1); ++j) {
          const std::size_t k = grid_.index(i, j);
          if (done[k] || std::abs(score_[k]) < limit || (score_[k] > 0) != raised) continue;
          done[k] = true;
          cells.push_back({i, j});
        }
      }
    }
    return summary(cells, raised);
  }

  // Smoothing has widened the patch by a cell: those below half its height are not of it.
  std::optional<LowObstacle> summary(const std::vector<std::pair<int, int>>& cells, bool raised) {
    scratch_.clear();
    for (const auto& [i, j] : cells) scratch_.push_back(std::abs(residual_[grid_.index(i, j)]));
    const float half = 0.5F * median(scratch_);
    LowObstacle result;
    double weight = 0, sum = 0, best = 0, shared = 0;
    for (const auto& [i, j] : cells) {
      const std::size_t k = grid_.index(i, j);
      const float height = raised ? residual_[k] : -residual_[k];
      best = std::max(best, static_cast<double>(std::abs(score_[k])));
      if (height < half) continue;
      const CellEvidence& c = grid_.cells[k];
      result.cells.push_back({i, j});
      weight += static_cast<double>(c.information);
      sum += static_cast<double>(c.information * residual_[k]);
      shared = std::max(shared, static_cast<double>(c.shared_variance));
      result.center_body += grid_.origin + grid_.cell_m * Eigen::Vector2d(i + 0.5, j + 0.5);
    }
    if (static_cast<int>(result.cells.size()) < options_.min_obstacle_cells) return std::nullopt;
    result.center_body /= static_cast<double>(result.cells.size());
    result.height = sum / weight;
    result.sigma = std::sqrt(1 / weight + shared);
    if (std::abs(result.height) < options_.min_obstacle_height_m) return std::nullopt;
    result.probability =
        1 - std::min(1.0, std::erfc(best / std::sqrt(2.0)) * static_cast<double>(tests_));
    return result;
  }

  const EvidenceGrid& grid_;
  const FloorOptions& options_;
  LocalFloor local_;
  std::vector<float> residual_, score_, error_, scratch_;
  std::int64_t tests_ = 0;
};

}  // namespace

float LocalFloor::at(int i, int j) const {
  const int a = i / step, b = j / step;
  const float s = static_cast<float>(i % step) / static_cast<float>(step);
  const float t = static_cast<float>(j % step) / static_cast<float>(step);
  float sum = 0, weight = 0;
  for (int da = 0; da < 2; ++da) {
    for (int db = 0; db < 2; ++db) {
      const Node& node = nodes[static_cast<std::size_t>((a + da) * rows + b + db)];
      const float w = (da ? s : 1 - s) * (db ? t : 1 - t);
      if (!node.known) continue;
      sum += w * node.height;
      weight += w;
    }
  }
  return weight > 1e-6F ? sum / weight : 0.0F;
}

double normal_threshold(double probability) {
  double low = 0, high = 40;
  for (int i = 0; i < 80; ++i) {
    const double middle = 0.5 * (low + high);
    (std::erfc(middle / std::sqrt(2.0)) > probability ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

std::vector<LowObstacle> find_low_obstacles(const EvidenceGrid& grid, const FloorOptions& options,
                                            std::vector<float>* residuals,
                                            LocalFloor* local_floor) {
  if (grid.cells.empty()) return {};
  Detector detector(grid, options);
  auto found = detector.run();
  if (residuals) *residuals = std::move(detector.residuals());
  if (local_floor) *local_floor = std::move(detector.local_floor());
  return found;
}

}  // namespace lamina
