// Every two waiting pairs, from the joint covariance of their four planes.
#include <lamina/backend/consistency/joint_duplicates.hpp>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <lamina/backend/association/level_separation.hpp>
#include <lamina/backend/association/plane_difference.hpp>
#include <lamina/backend/association/plane_neighbourhood.hpp>
#include <lamina/backend/solver/covariance.hpp>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180.0;
constexpr double kSameSide = 60 * kDegree;
constexpr double kOtherWay = 60 * kDegree;  // what p and q face
constexpr double kMostOff = 0.3;            // m: one wall stands no further apart
constexpr std::size_t kMostWaiting = 40;    // pairs, those that agree best

using Pair = std::pair<PlaneId, PlaneId>;

struct Waiting {
  PlaneId a = PlaneId::kNone, b = PlaneId::kNone;  ///< fewer views, more views
  PlaneGap gap;
  Eigen::Matrix3d C = Eigen::Matrix3d::Zero();
  double chi = 0;
  bool observed = false;
};

double chi_squared(const Eigen::Vector3d& off, const Eigen::Matrix3d& C) {
  const Eigen::LLT<Eigen::Matrix3d> llt(C);
  if (!C.allFinite() || llt.info() != Eigen::Success)
    return std::numeric_limits<double>::infinity();
  return off.dot(llt.solve(off));
}

bool shares_plane(const Waiting& p, const Waiting& q) {
  return p.a == q.a || p.a == q.b || p.b == q.a || p.b == q.b;
}

// Cross covariances of planes, each pair of planes asked for once.
class Crosses {
 public:
  void ask(PlaneId x, PlaneId y) {
    if (index_.try_emplace(std::minmax(x, y), request_.plane_pairs.size()).second)
      request_.plane_pairs.emplace_back(std::min(x, y), std::max(x, y));
  }
  bool solve(const Graph& graph) {
    found_ = covariances(graph, request_);
    return found_.valid;
  }
  /// Of x's tangent with y's.
  Eigen::Matrix3d operator()(PlaneId x, PlaneId y) const {
    const Matrix6d& joint = found_.plane_pairs[index_.at(std::minmax(x, y))];
    const Eigen::Matrix3d cross = joint.topRightCorner<3, 3>();
    return x < y ? cross : Eigen::Matrix3d(cross.transpose());
  }

 private:
  CovarianceRequest request_;
  std::map<Pair, std::size_t> index_;
  Covariances found_;
};

// Pairs that agree, best first; those that are known well enough by themselves are find_doubles()'.
std::vector<Waiting> waiting_pairs(const Graph& graph, const PlaneNeighbourhood& near,
                                   const LevelGaps& gaps, const std::set<Pair>& apart,
                                   const DoubleOptions& options) {
  std::vector<Waiting> pairs;
  CovarianceRequest request;
  for (const auto& [a, b] : near.pairs(kSameSide)) {
    const PlaneLandmark &small = graph.at(a), &large = graph.at(b);
    const double angle = angle_between(small.plane_anchor, large.plane_anchor);
    const double off = large.plane_map().signed_distance(near.middle(a));
    if (apart.count({a, b}) > 0 || apart.count({b, a}) > 0 ||
        angle > options.association.max_angle_deg * kDegree || !(std::abs(off) <= kMostOff) ||
        !near.beside(a, b) || gaps.apart(a, b)) {
      continue;
    }
    request.plane_pairs.emplace_back(a, b);
    pairs.push_back({a, b, gap_between(small, large, near.middle(a))});
  }
  const Covariances known = covariances(graph, request);
  if (!known.valid) return {};
  std::vector<Waiting> result;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    Waiting& p = pairs[i];
    p.C = p.gap.J * known.plane_pairs[i] * p.gap.J.transpose();
    p.C.diagonal() += surface_noise(options.association);
    p.chi = chi_squared(p.gap.off, p.C);
    if (p.chi <= options.gate && std::sqrt(p.C(2, 2)) > options.max_sigma_m) result.push_back(p);
  }
  std::stable_sort(result.begin(), result.end(),
                   [](const Waiting& x, const Waiting& y) { return x.chi < y.chi; });
  result.resize(std::min(result.size(), kMostWaiting));
  return result;
}

// Where p is one plane and narrows q down, and q is one plane, too, then.
bool confirms(const Waiting& p, const Waiting& q, const Crosses& crosses,
              const DoubleOptions& options) {
  Matrix6d cross;
  cross << crosses(q.a, p.a), crosses(q.a, p.b), crosses(q.b, p.a), crosses(q.b, p.b);
  const Eigen::Matrix3d C_qp = q.gap.J * cross * p.gap.J.transpose();
  const Eigen::Matrix3d gain = p.C.llt().solve(C_qp.transpose()).transpose();
  const Eigen::Matrix3d C = q.C - gain * C_qp.transpose();
  return C(2, 2) > 0 && std::sqrt(C(2, 2)) <= options.max_sigma_m &&
         !(chi_squared(q.gap.off - gain * p.gap.off, C) > options.gate);
}

// Of the pairs, those that another one confirms.
std::vector<Waiting> confirmed(const Graph& graph, std::vector<Waiting> waiting,
                               const DoubleOptions& options) {
  const auto independent = [&](const Waiting& p, const Waiting& q) {
    return !shares_plane(p, q) &&
           angle_between(graph.at(p.b).plane_anchor, graph.at(q.b).plane_anchor) >= kOtherWay;
  };
  Crosses crosses;
  bool any = false;
  for (const Waiting& p : waiting) {
    for (const Waiting& q : waiting) {
      if (!independent(p, q)) continue;
      any = true;
      for (const PlaneId x : {p.a, p.b})
        for (const PlaneId y : {q.a, q.b}) crosses.ask(x, y);
    }
  }
  if (!any || !crosses.solve(graph)) return {};
  for (Waiting& p : waiting) {
    for (Waiting& q : waiting) {
      if (independent(p, q) && confirms(p, q, crosses, options)) p.observed = q.observed = true;
    }
  }
  std::erase_if(waiting, [](const Waiting& p) { return !p.observed; });
  return waiting;
}

// Planes that agree with one plane, and are not one: which of them it is stays open.
std::set<PlaneId> ambiguous(const Graph& graph, const PlaneNeighbourhood& near,
                            const std::vector<Waiting>& pairs, double surface_sigma_m) {
  std::set<PlaneId> open;
  for (const Waiting& p : pairs) {
    for (const Waiting& q : pairs) {
      for (const auto& [one, other] : {Pair(p.a, p.b), Pair(p.b, p.a)}) {
        const PlaneId third = q.a == one ? q.b : q.b == one ? q.a : PlaneId::kNone;
        if (third == PlaneId::kNone || third == other) continue;
        const PlaneGap gap = gap_between(graph.at(third), graph.at(other), near.middle(third));
        if (std::abs(gap.off.z()) > 3 * surface_sigma_m) open.insert(one);
      }
    }
  }
  return open;
}

}  // namespace

std::vector<Pair> find_joint_duplicates(
    const Graph& graph, const std::map<PlaneId, std::vector<OutlinePiece>>& outlines,
    const std::set<Pair>& apart, const DoubleOptions& options) {
  const PlaneNeighbourhood near(graph, outlines, options.association.max_gap_m, false);
  const LevelGaps gaps(graph, outlines, options.association);
  const std::vector<Waiting> pairs =
      confirmed(graph, waiting_pairs(graph, near, gaps, apart, options), options);
  const std::set<PlaneId> open = ambiguous(graph, near, pairs, options.association.surface_sigma_m);
  std::set<PlaneId> taken;
  std::vector<Pair> doubles;
  for (const Waiting& p : pairs) {
    if (open.count(p.a) || open.count(p.b) || taken.count(p.a) || taken.count(p.b)) continue;
    taken.insert({p.a, p.b});
    doubles.emplace_back(p.a, p.b);
  }
  return doubles;
}

}  // namespace lamina
