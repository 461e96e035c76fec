// How far the body has come since its floor was as expected.
#include <lamina/frontend/depth/knock_watch.hpp>

namespace lamina {

bool KnockWatch::may_be(bool off, const SE3& T_start_body) {
  constexpr double kStill = 0.005, kWay = 3;  // m
  const double way = (T_start_last_.inverse() * T_start_body).translation().norm();
  if (!off) T_start_last_ = T_start_body;
  if (off && !off_) stood_ = way < kStill;
  off_ = off;
  return !off || stood_ || way > kWay;
}

}  // namespace lamina
