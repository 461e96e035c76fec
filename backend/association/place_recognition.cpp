// Hypotheses from two pairs of planes, verified by all.
#include <lamina/backend/association/place_recognition.hpp>

#include <Eigen/Cholesky>
#include <cmath>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180.0;
// Proposals looked at in one call, nearest pairs first: bounds the time.
constexpr std::size_t kMaxPairs = 120;
constexpr std::size_t kMaxProposals = 1500;

struct Pair {
  std::size_t fresh = 0, old = 0;
  double off = 0;  // how far apart they are now, m: nearest first
};

// x_old = body + R (x_new - body) + v.
struct Motion {
  Eigen::Vector3d v = Eigen::Vector3d::Zero();
  SO3 R;
  Matrix6d H = Matrix6d::Zero();  // of (v, w), pairs alone
};

struct Hypothesis {
  Motion motion;
  std::vector<Pair> pairs;
};

class Search {
 public:
  Search(std::span<const RecognitionPlane> fresh, std::span<const RecognitionPlane> old,
         const PlaneIndex& index, const Eigen::Vector3d& body, double reach,
         const PlaceRecognitionOptions& options)
      : fresh_(fresh), old_(old), index_(index), body_(body), reach_(reach), options_(options) {}

  std::optional<PlaceMatch> run();

 private:
  std::vector<Pair> nearby_pairs() const;
  std::optional<Motion> solve(const std::vector<Pair>& pairs) const;
  // Chi-squared of one pair under a motion; also its Jacobian and whitened residual.
  double evaluate(const Pair& pair, const Motion& motion, Eigen::Matrix<double, 3, 6>& J,
                  Eigen::Vector3d& r) const;
  std::vector<Pair> agreeing(const std::vector<Pair>& pairs, const Motion& motion) const;
  bool within_reach(const Motion& motion) const;
  bool determined(const Motion& motion) const;
  std::vector<Hypothesis> hypotheses(const std::vector<Pair>& pairs) const;
  bool rivals(const Hypothesis& rival, const Hypothesis& best) const;
  Eigen::Vector3d apply(const Motion& m, const Eigen::Vector3d& x) const {
    return body_ + m.R * Eigen::Vector3d(x - body_) + m.v;
  }

  std::span<const RecognitionPlane> fresh_, old_;
  const PlaneIndex& index_;
  Eigen::Vector3d body_;
  double reach_;
  const PlaceRecognitionOptions& options_;
};

std::vector<Pair> Search::nearby_pairs() const {
  const int cells = static_cast<int>(std::ceil(reach_ / index_.cell()));
  std::vector<Pair> pairs;
  for (std::size_t i = 0; i < fresh_.size(); ++i) {
    const std::vector<PlaneId> near = index_.near(fresh_[i].middle_map, cells);
    for (std::size_t j = 0; j < old_.size(); ++j) {
      if (!std::binary_search(near.begin(), near.end(), old_[j].id)) continue;
      if (angle_between(fresh_[i].plane_map, old_[j].plane_map) >
          options_.max_rotation_deg * kDegree) {
        continue;
      }
      const double off = std::abs(old_[j].plane_map.signed_distance(fresh_[i].middle_map));
      if (off <= reach_) pairs.push_back({i, j, off});
    }
  }
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const Pair& a, const Pair& b) { return a.off < b.off; });
  if (pairs.size() > kMaxPairs) pairs.resize(kMaxPairs);
  return pairs;
}

double Search::evaluate(const Pair& pair, const Motion& motion, Eigen::Matrix<double, 3, 6>& J,
                        Eigen::Vector3d& r) const {
  const RecognitionPlane &a = fresh_[pair.fresh], &b = old_[pair.old];
  const Eigen::Vector3d n = motion.R * a.plane_map.normal();
  const Eigen::Vector3d x = apply(motion, a.middle_map);
  const Matrix32d B = b.plane_map.tangent_basis();
  r << B.transpose() * n, b.plane_map.signed_distance(x);
  J.setZero();
  // w turns on the left of R: n' = n + w x n, x' = x + v + w x (x - body - v).
  J.topRightCorner<2, 3>() = -B.transpose() * SO3::hat(n);
  J.bottomLeftCorner<1, 3>() = b.plane_map.normal().transpose();
  const Eigen::Vector3d arm = x - body_ - motion.v;
  J.bottomRightCorner<1, 3>() = arm.cross(b.plane_map.normal()).transpose();
  Eigen::Matrix3d C = a.covariance;
  // The old plane's covariance at the new one's middle, and basis turned aside: only its size
  // counts.
  Eigen::Matrix3d at_middle = Eigen::Matrix3d::Identity();
  at_middle.bottomLeftCorner<1, 2>() = -(x - b.middle_map).transpose() * B;
  C += at_middle * b.covariance * at_middle.transpose();
  const double tilt = options_.local_sigma_deg * kDegree, rho = options_.local_sigma_m;
  C.diagonal() += Eigen::Vector3d(tilt * tilt, tilt * tilt, rho * rho);
  const Eigen::LLT<Eigen::Matrix3d> llt(C);
  if (llt.info() != Eigen::Success) return std::numeric_limits<double>::infinity();
  r = llt.matrixL().solve(r).eval();
  J = llt.matrixL().solve(J).eval();
  const double chi = r.squaredNorm();
  return std::isfinite(chi) ? chi : std::numeric_limits<double>::infinity();
}

std::optional<Motion> Search::solve(const std::vector<Pair>& pairs) const {
  Motion motion;
  // A weak prior keeps the directions that the pairs leave open near zero.
  Vector6d prior;
  const double move = 1 / options_.max_translation_m;
  const double turn = 1 / (options_.max_rotation_deg * kDegree);
  prior << move, move, 10 * move, 4 * turn, 4 * turn, turn;  // height and level drift less
  Eigen::Matrix<double, 3, 6> J;
  Eigen::Vector3d r;
  for (int round = 0; round < 4; ++round) {
    Matrix6d H = Matrix6d::Zero();
    Vector6d off, g;
    off << motion.v, motion.R.log();
    g = prior.cwiseAbs2().cwiseProduct(off);
    for (const Pair& pair : pairs) {
      if (!std::isfinite(evaluate(pair, motion, J, r))) return std::nullopt;
      H += J.transpose() * J;
      g += J.transpose() * r;
    }
    motion.H = H;
    H.diagonal() += prior.cwiseAbs2();
    const Vector6d d = H.llt().solve(-g);
    if (!d.allFinite() || d.tail<3>().norm() > 2) return std::nullopt;
    motion.v += d.head<3>();
    motion.R = SO3::exp(d.tail<3>()) * motion.R;
  }
  return motion;
}

std::vector<Pair> Search::agreeing(const std::vector<Pair>& pairs, const Motion& motion) const {
  // Each new plane with its best old one; each old one may take several (it was seen in pieces).
  std::vector<Pair> best(fresh_.size());
  std::vector<double> chi(fresh_.size(), options_.gate_chi_squared);
  std::vector<bool> found(fresh_.size(), false);
  Eigen::Matrix<double, 3, 6> J;
  Eigen::Vector3d r;
  for (const Pair& pair : pairs) {
    const double value = evaluate(pair, motion, J, r);
    if (!(value < chi[pair.fresh])) continue;
    const auto near = index_.near(apply(motion, fresh_[pair.fresh].middle_map), 1);
    if (!std::binary_search(near.begin(), near.end(), old_[pair.old].id)) continue;
    chi[pair.fresh] = value;
    best[pair.fresh] = pair;
    found[pair.fresh] = true;
  }
  std::vector<Pair> result;
  for (std::size_t i = 0; i < best.size(); ++i) {
    if (found[i]) result.push_back(best[i]);
  }
  return result;
}

bool Search::within_reach(const Motion& motion) const {
  return motion.v.norm() <= reach_ && motion.R.log().norm() <= options_.max_rotation_deg * kDegree;
}

// x, y and heading from the pairs alone; height and level may be anything else's to say.
bool Search::determined(const Motion& motion) const {
  Matrix6d H = motion.H;
  H.diagonal() += (Vector6d() << 1e-6, 1e-6, 1, 1, 1, 1e-6).finished();
  const Matrix6d C = H.llt().solve(Matrix6d::Identity());
  const double sure = options_.sure_m, sure_angle = options_.sure_deg * kDegree;
  return C.allFinite() && C(0, 0) < sure * sure && C(1, 1) < sure * sure &&
         C(5, 5) < sure_angle * sure_angle;
}

// Motions of two pairs each, with all that agree with them.
std::vector<Hypothesis> Search::hypotheses(const std::vector<Pair>& pairs) const {
  std::vector<Hypothesis> result;
  std::size_t proposals = 0;
  for (std::size_t a = 0; a < pairs.size() && proposals < kMaxProposals; ++a) {
    for (std::size_t b = a + 1; b < pairs.size() && proposals < kMaxProposals; ++b) {
      if (pairs[a].fresh == pairs[b].fresh) continue;
      const Eigen::Vector3d cross = fresh_[pairs[a].fresh].plane_map.normal().cross(
          fresh_[pairs[b].fresh].plane_map.normal());
      if (cross.norm() < 0.5) continue;
      ++proposals;
      auto motion = solve({pairs[a], pairs[b]});
      if (!motion || !within_reach(*motion)) continue;
      std::vector<Pair> inliers = agreeing(pairs, *motion);
      if (inliers.size() < static_cast<std::size_t>(options_.min_planes)) continue;
      motion = solve(inliers);
      if (!motion || !within_reach(*motion)) continue;
      inliers = agreeing(pairs, *motion);
      result.push_back({*motion, std::move(inliers)});
    }
  }
  return result;
}

// Another motion that nearly as many pairs agree with.
bool Search::rivals(const Hypothesis& rival, const Hypothesis& best) const {
  const bool other = (rival.motion.v - best.motion.v).norm() > 10 * options_.local_sigma_m ||
                     (rival.motion.R.inverse() * best.motion.R).log().norm() >
                         5 * options_.local_sigma_deg * kDegree;
  return other && static_cast<double>(rival.pairs.size()) >
                      options_.max_rival_share * static_cast<double>(best.pairs.size());
}

std::optional<PlaceMatch> Search::run() {
  const std::vector<Pair> pairs = nearby_pairs();
  if (pairs.size() < static_cast<std::size_t>(options_.min_planes)) return std::nullopt;
  const std::vector<Hypothesis> found = hypotheses(pairs);
  const auto best = std::max_element(
      found.begin(), found.end(),
      [](const Hypothesis& x, const Hypothesis& y) { return x.pairs.size() < y.pairs.size(); });
  if (best == found.end() || !determined(best->motion) ||
      best->pairs.size() < static_cast<std::size_t>(options_.min_planes) ||
      std::any_of(found.begin(), found.end(),
                  [&](const Hypothesis& rival) { return rivals(rival, *best); })) {
    return std::nullopt;
  }
  PlaceMatch match;
  match.T_old_new =
      SE3(best->motion.R, body_ + best->motion.v - best->motion.R * Eigen::Vector3d(body_));
  Eigen::Matrix<double, 3, 6> J;
  Eigen::Vector3d r;
  for (const Pair& pair : best->pairs) {
    match.pairs.emplace_back(fresh_[pair.fresh].id, old_[pair.old].id);
    match.chi_squared += evaluate(pair, best->motion, J, r);
  }
  return match;
}

}  // namespace

std::vector<std::string> PlaceRecognitionOptions::problems() const {
  std::vector<std::string> result;
  const auto require = [&result](bool holds, const char* text) {
    if (!holds) result.emplace_back(text);
  };
  require(min_planes >= 3, "place.min_planes: expected at least 3");
  require(gate_chi_squared > 0, "place.gate_chi_squared: expected more than 0");
  require(max_translation_m > 0, "place.max_translation_m: expected more than 0");
  require(max_rotation_deg > 0 && max_rotation_deg < 90,
          "place.max_rotation_deg: expected more than 0 and less than 90");
  require(max_rival_share > 0 && max_rival_share <= 1,
          "place.max_rival_share: expected more than 0 and at most 1");
  require(local_sigma_m > 0 && local_sigma_deg > 0,
          "place.local_sigma_m, place.local_sigma_deg: expected more than 0");
  require(every_keyframes >= 1, "place.every_keyframes: expected at least 1");
  return result;
}

std::optional<PlaceMatch> recognise_place(std::span<const RecognitionPlane> fresh,
                                          std::span<const RecognitionPlane> old,
                                          const PlaneIndex& index, const Eigen::Vector3d& body_map,
                                          double reach_m, const PlaceRecognitionOptions& options) {
  const double reach = std::min(reach_m, options.max_translation_m);
  if (!body_map.allFinite() || !(reach > 0)) return std::nullopt;
  return Search(fresh, old, index, body_map, reach, options).run();
}

}  // namespace lamina
