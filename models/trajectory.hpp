// Poses over time, and the TUM text form of them.
#pragma once

#include <filesystem>
#include <iosfwd>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <lamina/models/lie/se3.hpp>
#include <lamina/models/timestamp.hpp>

namespace lamina {

struct StampedPose {
  Timestamp stamp;
  SE3 pose;  ///< T_reference_body; the reference is the owner's to say
};

/// Poses in strictly increasing time.
class Trajectory {
 public:
  /// Appends; false (and nothing appended) when the stamp is not after the last one.
  bool add(Timestamp stamp, const SE3& pose);
  bool empty() const { return poses_.empty(); }
  std::size_t size() const { return poses_.size(); }
  const StampedPose& operator[](std::size_t i) const { return poses_[i]; }
  const StampedPose& front() const { return poses_.front(); }
  const StampedPose& back() const { return poses_.back(); }
  auto begin() const { return poses_.begin(); }
  auto end() const { return poses_.end(); }
  std::span<const StampedPose> poses() const { return poses_; }

  /// The pose at a time, on the geodesic between its neighbours; nullopt before the first or after
  /// the last, or where the neighbours are more than `max_gap` seconds apart.
  std::optional<SE3> at(Timestamp stamp, double max_gap = 1e9) const;
  /// Metres along the path.
  double length() const;

  /// TUM lines `timestamp tx ty tz qx qy qz qw`, '#' comments. Throws lamina::Error naming file and
  /// line for a line that cannot be read.
  static Trajectory read_tum(const std::filesystem::path& file);
  static Trajectory read_tum(std::istream& in, const std::string& name);
  /// Exactly 8 columns, single spaces, nothing trailing; nine decimals of everything.
  void write_tum(std::ostream& out) const;

 private:
  std::vector<StampedPose> poses_;
};

}  // namespace lamina
