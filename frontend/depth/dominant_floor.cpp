// The choice of the dominant floor.
#include <lamina/frontend/depth/dominant_floor.hpp>

#include <algorithm>
#include <cmath>
#include <optional>

#include <lamina/frontend/depth/leveling.hpp>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180;

struct Scored {
  int index = -1;
  double score = 0, tilt = 0, height = 0, height_error = 0;
};

Scored score(const FloorCandidate& c, const FloorPrior& prior) {
  Scored s;
  const Leveling l = leveling_of(prior.T_body_camera, c.plane_camera);
  s.tilt = std::hypot(l.roll, l.pitch);
  s.height = l.height;
  s.height_error = l.height - prior.T_body_camera.translation().z();
  // Tilt and height (deg, m) a floor may be off by: a tape measure's errors, or a hand's movement.
  constexpr double kTilt[] = {25, 8, 6, 6};
  constexpr double kHeight[] = {1e9, 0.15, 0.1, 0.1};
  const std::size_t k = static_cast<std::size_t>(prior.knowledge);
  s.score = c.area * std::exp(-std::pow(s.tilt / (kTilt[k] * kDegree), 2) -
                              std::pow(s.height_error / kHeight[k], 2));
  return s;
}

FloorChoice refuse(FloorStatus status, const char* reason) { return {status, -1, reason}; }

// With nothing known: lowest of those that hold at least 0.35 of the best score.
Scored lowest_large(std::span<const Scored> all, double best) {
  Scored chosen;
  for (const Scored& s : all) {
    if (s.score >= 0.35 * best && (chosen.index < 0 || s.height > chosen.height)) chosen = s;
  }
  return chosen;
}

bool tilted(const Scored& s) { return s.tilt > 1.5 * kDegree; }

// m that a floor's height may be off, where this much is known of the mounting.
double most_off(bool is_tilted, const FloorPrior& prior) {
  return is_tilted && prior.rigid() ? 0.04 : prior.rigid() ? 0.15 : 0.3;
}

bool fits(const Scored& s, const FloorPrior& prior) {
  return std::abs(s.height_error) <= most_off(tilted(s), prior);
}

// Neither tilted nor further off than a tilted one may be.
bool as_before(const Scored& s, const FloorPrior& prior) {
  return !tilted(s) && std::abs(s.height_error) <= most_off(true, prior);
}

template <class May>
Scored best_of(std::span<const Scored> all, const May& may) {
  Scored best;
  for (const Scored& s : all) {
    if (may(s) && (best.index < 0 || s.score > best.score)) best = s;
  }
  return best;
}

bool rivals(std::span<const Scored> all, const Scored& chosen) {
  for (const Scored& s : all) {
    if (s.index == chosen.index || s.score < 0.6 * chosen.score) continue;
    if (std::abs(s.height - chosen.height) > 0.04 || std::abs(s.tilt - chosen.tilt) > 2 * kDegree) {
      return true;
    }
  }
  return false;
}

// A camera of unknown mounting that sees one plane and next to nothing else: that plane, when it is
// no wall of a level camera.
constexpr double kAlone = 0.5;      // of the frame's pixels it holds at least
constexpr double kBesides = 0.1;    // of its pixels any other plane holds at most
constexpr double kSideways = 0.35;  // of its normal at most: such a camera is not rolled as well

std::optional<Scored> alone_in_view(std::span<const FloorCandidate> planes, double frame_pixels,
                                    const FloorPrior& prior, const FloorOptions& options) {
  const auto largest =
      std::max_element(planes.begin(), planes.end(),
                       [](const auto& a, const auto& b) { return a.pixels < b.pixels; });
  const Plane& floor = largest->plane_camera;
  for (const FloorCandidate& c : planes) {
    // An uneven road falls into pieces: those lie like the largest.
    const bool like = c.plane_camera.normal().dot(floor.normal()) > std::cos(5 * kDegree) &&
                      std::abs(c.plane_camera.rho() - floor.rho()) < 0.05;
    if (!like && c.pixels > kBesides * largest->pixels) return std::nullopt;
  }
  Scored s = score(*largest, prior);
  s.index = static_cast<int>(largest - planes.begin());
  const bool stands = s.height >= options.min_height_m && s.height <= options.max_height_m;
  const bool filled = largest->pixels >= kAlone * frame_pixels;
  const bool upright = std::abs(largest->plane_camera.normal().x()) <= kSideways;
  if (!stands || !filled || !upright || s.tilt > kSteepConeDeg * kDegree) {
    return std::nullopt;
  }
  return s;
}

// Tilted within the cone (rad), at a height that cameras have.
std::vector<Scored> lying_as_floors(std::span<const FloorCandidate> planes, double cone,
                                    const FloorPrior& prior, const FloorOptions& options) {
  std::vector<Scored> all;
  for (std::size_t i = 0; i < planes.size(); ++i) {
    Scored s = score(planes[i], prior);
    s.index = static_cast<int>(i);
    if (s.tilt > cone) continue;
    if (s.height < options.min_height_m || s.height > options.max_height_m) continue;
    all.push_back(s);
  }
  return all;
}

}  // namespace

FloorChoice choose_floor(std::span<const FloorCandidate> planes, double frame_pixels,
                         const FloorPrior& prior, const FloorOptions& options) {
  if (planes.empty()) return refuse(FloorStatus::kNoPlanes, "no plane in the frame");
  const double cones[] = {options.unknown_cone_deg, 15, 12, 6};
  const double cone = cones[static_cast<std::size_t>(prior.knowledge)] * kDegree;
  std::vector<Scored> all = lying_as_floors(planes, cone, prior, options);
  double best = 0;
  for (const Scored& s : all) best = std::max(best, s.score);
  if (all.empty() && prior.knowledge == MountingKnowledge::kUnknown) {
    if (const auto plane = alone_in_view(planes, frame_pixels, prior, options)) {
      all.push_back(*plane);
      best = plane->score;
    }
  }
  if (all.empty()) return refuse(FloorStatus::kNoFloor, "no plane lies as a floor would");
  Scored chosen;
  if (prior.knowledge != MountingKnowledge::kUnknown) {
    chosen = best_of(all, [](const Scored&) { return true; });
    // A ramp or a stair may fill the view, and the floor before it lie where it always did.
    if (!fits(chosen, prior) && prior.knowledge == MountingKnowledge::kTracked)
      chosen = best_of(all, [&](const Scored& s) { return as_before(s, prior); });
    if (chosen.index < 0 || !fits(chosen, prior)) {
      return refuse(FloorStatus::kAmbiguous,
                    "planes lie flat but not where the floor is: stairs or a ramp");
    }
  } else {
    chosen = lowest_large(all, best);
    if (rivals(all, chosen)) {
      return refuse(FloorStatus::kAmbiguous, "several levels or slopes could be the floor");
    }
  }
  const FloorCandidate& c = planes[static_cast<std::size_t>(chosen.index)];
  if (c.pixels < options.dominant_min_share * frame_pixels ||
      c.area < options.dominant_min_area_m2) {
    return refuse(FloorStatus::kTooSmall, "too little floor in view");
  }
  return {FloorStatus::kFound, chosen.index, ""};
}

}  // namespace lamina
