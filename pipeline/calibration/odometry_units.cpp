// Every unit is tried by a pass over the same images, which begin where it says.
#include <lamina/pipeline/calibration/odometry_units.hpp>

#include <fmt/format.h>
#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <string>

#include <lamina/frontend/motion/depth_odometry.hpp>
#include <lamina/frontend/motion/planar.hpp>
#include <lamina/models/median.hpp>
#include <lamina/pipeline/calibration/camera/image_turns.hpp>
#include <lamina/pipeline/calibration/scanner_check.hpp>
#include <lamina/pipeline/calibration/wheel_scale.hpp>

namespace lamina {
namespace {

const ScannerCheckOptions kOptions;

// A piece of way by images and by wheels; without one of them it fits nothing.
struct Piece {
  SE3 images, wheels;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  // of the images alone
  bool measured = true;

  static bool moved(const SE3& T) {
    return T.translation().norm() > kOptions.travelling || T.so3().log().norm() > kOptions.turning;
  }
  bool whole() const { return moved(images) || moved(wheels); }
  // Where images leave the way open it is what it was expected to be: no evidence of it.
  bool tells() const {
    const Eigen::Vector2d way = images.translation().head<2>();
    const double length = way.norm();
    if (!measured || length < kOptions.travelling) return true;
    const double sigma = std::sqrt(way.dot(covariance.topLeftCorner<2, 2>() * way)) / length;
    return sigma < 0.5 * length;
  }
  double cost(double way) const {
    if (!measured) return kOptions.most_cost;
    const SE3 by_wheels(wheels.so3(), way * wheels.translation());
    const PlanarPose off = planar_part(by_wheels.inverse() * images);
    const Eigen::Vector3d e(off.x, off.y, off.yaw);
    const double t =
        std::hypot(kOptions.sigma_way, kOptions.sigma_share * by_wheels.translation().norm());
    const double r = std::hypot(kOptions.sigma_turn, kOptions.sigma_share * wheels.so3().yaw());
    Eigen::Matrix3d S = covariance;
    S.diagonal() += Eigen::Vector3d(t * t, t * t, r * r);
    return std::min(kOptions.most_cost, e.dot(S.ldlt().solve(e)));
  }
};

// Of one step, in the plane. A metre, a radian: what is open stays finite.
Eigen::Matrix3d covariance_of(const DepthMotion& motion) {
  Matrix6d information = motion.image_information;
  information.diagonal().array() += 1;
  return planar_block(Matrix6d(information.inverse()));
}

std::vector<Piece> pieces_of(const OpenInUnits& open, const OdometryUnits& units,
                             const std::function<bool()>& ended) {
  const Wheels wheels = wheels_of(*open(units), ended);
  std::vector<Piece> pieces;
  if (!wheels.track.moved()) return pieces;
  const auto recording = open(units);
  DepthOdometry odometry;
  std::optional<Timestamp> last;
  Piece piece;
  while (!ended() && pieces.size() < kOptions.most_pairs) {
    const auto frame = next_image(*recording, 0);
    if (!frame) break;
    const bool follows = last && frame->stamp - *last < UsualFit::kLongGap;
    const bool known = wheels.track.at(frame->stamp) && (!last || wheels.track.at(*last));
    // Covered, or too near: no evidence of anything.
    const bool shows = depth_blocks(*frame, odometry.options().blocks).any_oriented();
    if (!follows || !known || !shows) {
      odometry = DepthOdometry();
      piece = Piece();
    }
    const auto moved = follows ? wheels.track.between(*last, frame->stamp) : std::nullopt;
    const DepthMotion motion = odometry.process(*frame, loose(moved));
    last = frame->stamp;
    if (!follows || !known || !shows) continue;
    piece.measured = piece.measured && moved && motion.explained && !motion.doubtful;
    piece.images = piece.images * motion.T_prev_curr_body;
    piece.wheels = piece.wheels * (moved ? moved->T_from_to : SE3());
    piece.covariance += covariance_of(motion);
    if (piece.measured && !piece.whole()) continue;
    if (piece.tells()) pieces.push_back(piece);
    piece = Piece();
  }
  return pieces;
}

// Units, and how well pieces fit by them.
struct Claim {
  OdometryUnits units;
  std::vector<Piece> pieces;
  double factor = 1;  // of the way, beyond the units
  double mean = 0;    // cost of a piece
  void score() {
    double sum = 0;
    for (const Piece& piece : pieces) sum += piece.cost(factor);
    mean = pieces.empty() ? kOptions.most_cost : sum / static_cast<double>(pieces.size());
  }
  // The way that fits most of the pieces measured.
  void fit_factor() {
    std::vector<double> ratios;
    for (const Piece& piece : pieces) {
      const double way = piece.wheels.translation().norm();
      if (piece.measured && way > kOptions.sigma_way)
        ratios.push_back(piece.images.translation().dot(piece.wheels.translation()) / (way * way));
    }
    if (ratios.size() < kOptions.least_pairs) return;
    const auto middle = median(ratios);
    if (std::abs(middle - 1) <= WheelScale::kBound || !(middle > 0)) return;
    const double before = mean;
    factor = middle;
    score();
    if (before - mean > kOptions.simpler / static_cast<double>(pieces.size())) return;
    factor = 1;
    mean = before;
  }
};

Claim claim_of(const OpenInUnits& open, const OdometryUnits& units,
               const std::function<bool()>& ended) {
  Claim claim{units, pieces_of(open, units, ended)};
  claim.score();
  return claim;
}

bool explains(const Claim& best, const Claim& stated) {
  const double pieces = static_cast<double>(best.pieces.size());
  return best.pieces.size() >= kOptions.least_pairs &&
         best.mean < kOptions.most_ratio * stated.mean &&
         (stated.mean - best.mean) * pieces > kOptions.least_gain;
}

struct Unit {
  const char* name;
  double metres;
};
constexpr Unit kUnits[] = {
    {"millimetres", 0.001}, {"centimetres", 0.01}, {"inches", 0.0254}, {"feet", 0.3048}};

// As stated, in other units, in degrees, and with the way that fits most.
Claim best_of(const OpenInUnits& open, const Claim& stated, const std::function<bool()>& ended) {
  Claim best = stated;
  const auto ask = [&](const OdometryUnits& units) {
    Claim claim = claim_of(open, units, ended);
    if (claim.mean < best.mean) best = std::move(claim);
  };
  for (const Unit& unit : kUnits) ask({unit.metres, 1});
  if (!explains(best, stated)) {
    const double way = best.units.way;
    ask({1, M_PI / 180});
    if (way != 1) ask({way, M_PI / 180});
  }
  if (best.units.turn == 1) best.fit_factor();
  return best;
}

std::string found_text(const Claim& claim) {
  std::string text;
  for (const Unit& unit : kUnits)
    if (claim.units.way == unit.metres) text = fmt::format("positions in {}", unit.name);
  if (claim.units.turn != 1) text += std::string(text.empty() ? "" : ", ") + "headings in degrees";
  if (claim.factor != 1)
    text +=
        fmt::format("{}{:.3g} times the odometry's way", text.empty() ? "" : ", ", claim.factor);
  return text;
}

}  // namespace

OdometryUnits look_at_odometry_units(const OpenInUnits& open, const CalibrationOptions& settings,
                                     std::vector<Warning>& warnings,
                                     const std::function<bool()>& ended) {
  const Claim stated = claim_of(open, {}, ended);
  const double pieces = static_cast<double>(stated.pieces.size());
  if (ended() || stated.pieces.size() < kOptions.least_pairs ||
      stated.mean * pieces < kOptions.least_gain)
    return {};
  const Claim best = best_of(open, stated, ended);
  if (ended() || !explains(best, stated)) return {};
  warnings.push_back(
      {"wheel_scale",
       fmt::format(
           "odometry in other units than metres and radians: {} by the motion that images show "
           "(cost of a piece of way {:.1f} as stated, {:.1f} so, over {}); {}",
           found_text(best), stated.mean, best.mean, stated.pieces.size(),
           settings.calibrate_wheels ? "corrected" : "wheels.calibrate is off: left as it is")});
  if (!settings.calibrate_wheels) return {};
  return {best.units.way * best.factor, best.units.turn};
}

}  // namespace lamina
