// The start against what most places further on agree on.
#include <lamina/frontend/depth/tilted_start.hpp>
#include <lamina/models/median.hpp>

#include <algorithm>
#include <cmath>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180;
constexpr double kStill = 0.05;           // m: the body has hardly moved yet
constexpr double kOff = 1, kDecided = 2;  // m: wheels are off an edge by then; the start is over
constexpr double kPlace = 0.1;            // m from one place to the next
constexpr double kAlike = 0.5 * kDegree, kTilted = 0.8 * kDegree;
constexpr std::size_t kLeastPlaces = 20;
constexpr double kMost = 0.5, kFew = 0.25;  // of the places

double apart(const Leveling& a, const Leveling& b) {
  return std::hypot(a.roll - b.roll, a.pitch - b.pitch);
}

Leveling median(const std::vector<Leveling>& all) {
  const auto of = [&all](double Leveling::*member) {
    std::vector<double> values;
    for (const Leveling& one : all) values.push_back(one.*member);
    return lamina::median(values);
  };
  return {of(&Leveling::roll), of(&Leveling::pitch), of(&Leveling::height)};
}

std::vector<Leveling> alike(const std::vector<Leveling>& all, const Leveling& to) {
  std::vector<Leveling> found;
  std::copy_if(all.begin(), all.end(), std::back_inserter(found),
               [&to](const Leveling& one) { return apart(one, to) < kAlike; });
  return found;
}

}  // namespace

SE3 TiltedStart::T_level_body() const {
  const SE3 T_level_camera = apply(start, T_body_camera);
  const SE3 T = T_level_camera * apply(usual, T_body_camera).inverse();
  const SO3 R = SO3::rot_z(-T.so3().yaw()) * T.so3();
  return SE3(R, {0, 0, T.translation().z()});
}

void StartWatch::add(const Leveling& leveling, double way) {
  if (state_ == State::kUsual) return;
  if (way < kStill) {
    if (state_ == State::kUnknown) start_.push_back(leveling);
    return;
  }
  if (start_.empty()) {  // no floor was seen there
    state_ = State::kUsual;
    return;
  }
  if (way > kOff && way < kDecided && apart(leveling, median(start_)) < kTilted) {
    state_ = State::kUsual;
    return;
  }
  if (way >= kDecided) state_ = State::kTilted;
  if (way < kOff || (!later_.empty() && way - last_way_ < kPlace)) return;
  later_.push_back(leveling);
  last_way_ = way;
}

std::optional<TiltedStart> StartWatch::result() const {
  if (state_ != State::kTilted || later_.size() < kLeastPlaces) return std::nullopt;
  std::vector<Leveling> most;
  for (const Leveling& one : later_) {
    std::vector<Leveling> like = alike(later_, one);
    if (like.size() > most.size()) most = std::move(like);
  }
  const double places = static_cast<double>(later_.size());
  const TiltedStart found{T_body_camera_, median(most), median(start_)};
  if (static_cast<double>(most.size()) <= kMost * places ||
      static_cast<double>(alike(later_, found.start).size()) >= kFew * places ||
      apart(found.start, found.usual) < kTilted) {
    return std::nullopt;
  }
  return found;
}

}  // namespace lamina
