// The conventions of the whole project, on one screen. Comment only.
//
// Units     SI and radians inside and in files; a suffix where it differs (`fov_deg`, `depth_raw`).
// Names     T_a_b maps coordinates in b to coordinates in a, and is b's pose in a.
//           `points_sensor`, `plane_map`: the last word is the frame.
// Frames    (REP 103 / 105)
//   map     z up; the odometry frame, or floor at z = 0 where there is no odometry.
//   odom    what wheel odometry integrates in.
//   body    x forward, y left, z up, origin on the floor under the robot.
//   camera  optical: z forward, x right, y down.
//   lidar   the scan lies in its x-y plane, angle 0 along x, counter-clockwise.
// Rotation  Hamilton quaternions stored x y z w. Perturbation on the right: T * exp(d),
//           d = (translation, rotation).
// Plane     n.x = rho, |n| = 1, n points to the side the plane was seen from, rho is signed.
//           Spherical: n = (sin t cos p, sin t sin p, cos t), t in [0, pi] from +z, p in (-pi, pi].
//           A scanner in its x-y plane sees the line at distance rho / sin t, angle p.
// Time      Timestamp: int64 nanoseconds. Differences are double seconds.
// Weights   Moments that leave a front-end carry weights 1/sigma^2 (1/m^2) along the plane's
//           normal, so that p^T M p is a chi-squared; NoiseFloor holds what points share.
#pragma once
