// Upright blocks of images a little apart in time, each against the other's free space.
#include <lamina/frontend/motion/kidnap_detector.hpp>

#include <algorithm>
#include <cmath>

#include <lamina/frontend/motion/moving_blocks.hpp>

namespace lamina {
namespace {

constexpr double kLevel = 0.8;   // cosine to up of what is floor, table or ceiling
constexpr double kAlike = 0.9;   // share of what is told: stands still
constexpr double kUnlike = 0.6;  // likewise, below: may be another place
constexpr double kEither = 0.1;  // least share that has come, and that has gone
constexpr int kFew = 60;         // blocks: tell nothing

struct Count {
  int like = 0, before = 0;
};

Count count(const DepthBlocks& back, const DepthBlocks& front, const SE3& T_back_front,
            const Eigen::Vector3d& up_front) {
  const Eigen::Matrix3f R = T_back_front.so3().matrix().cast<float>();
  const Eigen::Vector3f t = T_back_front.translation().cast<float>();
  const Eigen::Vector3f up = up_front.cast<float>();
  Count result;
  for (const DepthBlock& block : front.blocks) {
    if (!block.oriented() || std::abs(block.normal.dot(up)) > kLevel) continue;
    const Eigen::Vector3f q = R * block.point + t;
    switch (seen_from(back, q, block.sigma)) {
      case SeenFrom::kBefore:
        ++result.before;
        break;
      case SeenFrom::kLike:
        ++result.like;
        break;
      case SeenFrom::kUnknown:
        break;
    }
  }
  return result;
}

}  // namespace

PlaceLikeness place_likeness(const DepthBlocks& a, const DepthBlocks& b, const SE3& T_a_b,
                             const Eigen::Vector3d& up_a, const Eigen::Vector3d& up_b) {
  const Count later = count(a, b, T_a_b, up_b);
  const Count earlier = count(b, a, T_a_b.inverse(), up_a);
  return {later.like + earlier.like, later.before, earlier.before};
}

void PlaceWatch::View::move(const SE3& by_image, const SE3& by_wheels) {
  moved_by_image = moved_by_image * by_image;
  moved_by_wheels = moved_by_wheels * by_wheels;
}

namespace {

PlaceLikeness likeness(const DepthBlocks& a, const SE3& T_body_a, const DepthBlocks& b,
                       const SE3& T_body_b, const SE3& moved) {
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  return place_likeness(a, b, T_body_a.inverse() * moved * T_body_b, T_body_a.so3().inverse() * up,
                        T_body_b.so3().inverse() * up);
}

}  // namespace

bool PlaceWatch::another_place(const View& before, const View& now) {
  for (const SE3& moved : {before.moved_by_image, before.moved_by_wheels}) {
    const PlaceLikeness l =
        likeness(before.blocks, before.T_body_camera, now.blocks, now.T_body_camera, moved);
    const double observed = l.observed();
    if (l.observed() < kFew || l.like > kUnlike * observed ||
        std::min(l.come, l.gone) < kEither * observed)
      return false;
  }
  return true;
}

bool PlaceWatch::same_place(const View& before, const View& now) {
  for (const SE3& moved : {before.moved_by_image, before.moved_by_wheels}) {
    const PlaceLikeness l =
        likeness(before.blocks, before.T_body_camera, now.blocks, now.T_body_camera, moved);
    if (l.observed() >= kFew && l.like >= kAlike * l.observed()) return true;
  }
  return false;
}

std::optional<std::size_t> PlaceWatch::add(const DepthFrame& frame, const SE3& by_image,
                                           const SE3& by_wheels) {
  View now{depth_blocks(frame), frame.camera.camera.T_body_camera, frame.stamp, SE3(), SE3()};
  std::optional<std::size_t> found;
  if (old_) old_->move(by_image, by_wheels);
  if (new_) {
    new_->move(by_image, by_wheels);
    ++since_;
    if (!another_place(*old_, now) || !same_place(*new_, now)) {
      new_.reset();
    } else if (since_ + 1 >= kSure && now.stamp - new_->stamp >= kSureTime) {
      found = since_;
      new_.reset();
    }
  } else if (old_ && another_place(*old_, now)) {
    new_ = std::move(now);
    since_ = 0;
    return std::nullopt;
  }
  if (!new_) old_ = std::move(now);
  return found;
}

}  // namespace lamina
