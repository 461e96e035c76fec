// Pieces of surfaces that bend: chords of arcs, and lines that may be chords where much else is.
#include <algorithm>
#include <cmath>

#include <lamina/frontend/segments/arc_fit.hpp>
#include <lamina/frontend/segments/segment_extractor.hpp>

namespace lamina {
namespace {
// A parameter more must gain this much chi-squared when an arc competes with lines.
constexpr double kArcParameterCost = 5;
// How much more than the threshold of a split a chord of an arc may miss by.
constexpr double kArcMissFactor = 6;
}  // namespace

// Could an arc look like these lines? It turns the same way at every joint, and by no more than
// chords turn that were not worth splitting: on an arc a chord of length L that meets its
// neighbours at the angle b misses by 0.3 L b / 8 (root mean square).
bool SegmentExtractor::arc_is_possible(std::size_t first, std::size_t last) const {
  Eigen::Vector2d before = Eigen::Vector2d::Zero();
  double side = 0, before_length = 0;
  int before_count = 0;
  for (std::size_t k = first; k <= last; ++k) {
    Eigen::Vector2d line;
    const Run& run = runs_[k];
    if (!run.sums.solve(line.x(), line.y())) return false;
    line.normalize();
    const double length = (points_.point(run.end() - 1) - points_.point(run.begin())).norm();
    if (k > first) {
      const double turn =
          std::asin(std::clamp(before.x() * line.y() - before.y() * line.x(), -1.0, 1.0));
      if (before.dot(line) < 0 || turn * side < 0) return false;
      side = turn;
      const auto too_much = [&](double chord, int count) {
        const double miss = 0.3 * chord * turn / 8 / points_.sigma_r();
        return count * miss * miss > kArcMissFactor * threshold(count);
      };
      if (too_much(length, run.sums.count) || too_much(before_length, before_count)) return false;
    }
    before = line;
    before_length = length;
    before_count = run.sums.count;
  }
  return true;
}

std::optional<Arc> SegmentExtractor::arc_through(std::size_t first, std::size_t last) const {
  std::vector<int> indices;
  for (std::size_t k = first; k <= last; ++k) {
    for (const auto& [begin, end] : runs_[k].parts) {
      for (int i = begin; i < end; ++i) indices.push_back(i);
    }
  }
  return fit_arc(points_, indices, options_.outlier_sigma * options_.outlier_sigma);
}

bool SegmentExtractor::arc_wins(std::size_t first, std::size_t last) const {
  double lines = 0;
  for (std::size_t k = first; k <= last; ++k) lines += runs_[k].sums.cost();
  const double pieces = static_cast<double>(last - first + 1);
  // Two lines meeting are the ordinary corner: an arc must win without any discount.
  const double discount = pieces > 2 ? (3 * pieces - 1 - 3) * kArcParameterCost : 0;
  const std::optional<Arc> arc = arc_through(first, last);
  return arc && arc->cost < lines + discount;
}

// Windows of three neighbouring pieces, then of two: a piece of a column or a tank is none of a
// plane.
std::vector<char> SegmentExtractor::chords() const {
  std::vector<char> curved(runs_.size(), 0);
  for (const std::size_t window : {std::size_t{3}, std::size_t{2}}) {
    for (std::size_t i = 0; i + window <= runs_.size(); ++i) {
      bool chain = true;
      for (std::size_t k = i; k < i + window; ++k) {
        chain &= runs_[k].sums.count >= 4 && (k == i || contiguous(runs_[k - 1], runs_[k]));
      }
      if (!chain || !arc_is_possible(i, i + window - 1) || !arc_wins(i, i + window - 1)) continue;
      std::fill_n(curved.begin() + static_cast<std::ptrdiff_t>(i), window, 1);
    }
  }
  return curved;
}

namespace {

struct Piece {
  std::size_t run;
  int count;              // returns
  double straight, bent;  // likelihoods; the second times the returns of its kind
};

// Those that are likelier bent than straight, one by one: what is bent is no longer evidence of
// straight walls.
void mark_bent(std::vector<Piece> pieces, std::vector<char>& curved) {
  int straight = 0;
  for (const Piece& piece : pieces) straight += piece.count;
  const auto is_bent = [&](const Piece& piece) { return piece.bent > straight * piece.straight; };
  for (auto at = pieces.begin();
       (at = std::find_if(pieces.begin(), pieces.end(), is_bent)) != pieces.end();) {
    curved[at->run] = 1;
    straight -= at->count;
    pieces.erase(at);
  }
}

}  // namespace

// A chord too short or too noisy to show its bend looks like a wall, and slides along with a robot
// that follows the curve: taken for one wall, it turns the map with the robot. What a piece is,
// its own returns and the rest of the scan tell together: the chance that it is straight, or as
// bent as one of the arcs, is how many returns are on pieces of that kind, times the likelihood of
// its curvature. Where all that can be told is straight nothing changes, and a wall that is long
// against its noise is a wall anywhere.
void SegmentExtractor::uncertain_straight(std::vector<char>& curved) const {
  struct Kind {
    double curvature;
    int count;
  };
  std::vector<Kind> arcs;
  for (std::size_t first = 0; first < curved.size(); ++first) {
    if (!curved[first]) continue;
    std::size_t last = first;
    int count = runs_[first].sums.count;
    while (last + 1 < curved.size() && curved[last + 1] &&
           contiguous(runs_[last], runs_[last + 1])) {
      count += runs_[++last].sums.count;
    }
    // Columns are things that stand about; a wall beside them is no likelier to bend.
    const std::optional<Arc> arc = arc_through(first, last);
    if (arc && !arc->column) {
      arcs.push_back({arc->curvature, count});
    }
    first = last;
  }
  if (arcs.empty()) return;
  std::vector<Piece> pieces;
  for (std::size_t k = 0; k < curved.size(); ++k) {
    if (curved[k] || runs_[k].sums.count < options_.min_points) continue;
    const std::optional<Arc> own = arc_through(k, k);
    if (!own) continue;
    const auto likelihood = [&](double curvature) {
      const double off = own->curvature - curvature;
      return std::exp(-0.5 * off * off * own->information);
    };
    double bent = 0;
    for (const Kind& arc : arcs) bent += arc.count * likelihood(arc.curvature);
    pieces.push_back({k, runs_[k].sums.count, likelihood(0), bent});
  }
  mark_bent(std::move(pieces), curved);
}

void SegmentExtractor::drop_curved(Segments& out) {
  std::vector<char> curved = chords();
  uncertain_straight(curved);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < runs_.size(); ++i) {
    if (curved[i]) {
      ++out.curved;
    } else {
      if (kept != i) runs_[kept] = std::move(runs_[i]);
      ++kept;
    }
  }
  runs_.resize(kept);
}

}  // namespace lamina
