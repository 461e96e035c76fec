// Plane graphs of any size: buildings of rooms seen by a moving depth sensor, as solver problems
// with given associations and exact truth.
#pragma once

#include <cstdint>
#include <filesystem>
#include <iosfwd>

namespace lamina::sim {

/// Rooms of 6 x 6 m on storeys of 3 m, each with four walls, floor, ceiling and one tilted panel;
/// the sensor circles in every room, room after room, lap after lap.
struct PlaneGraphOptions {
  int rooms_x = 5, rooms_y = 5, storeys = 2;
  int poses_per_room = 20;          ///< a lap
  int laps = 2;                     ///< later laps stand between the places of earlier ones
  bool shared_floor = false;        ///< one floor plane a storey instead of one a room
  double sigma_translation = 0.01;  ///< m a step, each axis
  double sigma_rotation = 0.002;    ///< rad a step, each axis
  double sigma_point = 0.01;        ///< m, each axis
  int points = 30;                  ///< of each observation
  double visibility = 0.6;          ///< chance that a pose sees a plane of its room
  double through_door = 0.1;        ///< chance for a plane of the next room that faces the pose
  std::uint64_t seed = 1;

  /// Throws lamina::Error when a number makes no sense.
  void check() const;
  std::int64_t poses() const;
  std::int64_t planes() const;
  /// As near to `poses` as whole rooms allow, at least one room: 20 poses a room and lap, two laps,
  /// two storeys from four rooms on.
  static PlaneGraphOptions of_size(std::int64_t poses);
};

struct PlaneGraphCounts {
  std::int64_t poses = 0, planes = 0, odometry = 0, observations = 0;
};

/// Writes records SIG, GT, INIT, PLANE, ODO and OBS (docs/simulator.md). The same options give the
/// same bytes. Observations stream: memory is what poses and planes need.
PlaneGraphCounts write_plane_graph(const PlaneGraphOptions& options, std::ostream& out);
/// Throws lamina::Error when the file cannot be written.
PlaneGraphCounts write_plane_graph(const PlaneGraphOptions& options,
                                   const std::filesystem::path& file);

}  // namespace lamina::sim
