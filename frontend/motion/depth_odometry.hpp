// Motion of a depth camera from its images alone: frame to key frames, point to plane.
#pragma once

#include <deque>
#include <optional>

#include <lamina/frontend/motion/depth_blocks.hpp>
#include <lamina/frontend/motion/match_quality.hpp>
#include <lamina/frontend/motion/motion_limits.hpp>
#include <lamina/frontend/motion/scan_odometry.hpp>

namespace lamina {

struct DepthOdometryOptions {
  DepthBlockOptions blocks;
  int coarse_stride = 3;  ///< blocks skipped in both directions while the way is sought
  int coarse_iterations = 8, fine_iterations = 8;
  double coarse_gate = 0.3;  ///< m off the plane, and a quarter of the depth beside it
  double fine_gate = 0.05;   ///< m (or 4 sigma)
  double min_normal_cosine = 0.8;
  /// m, flatness of surfaces within what two images' blocks see of them: however well near floor is
  /// measured, it does not outweigh all that stands further off.
  double surface_sigma = 0.005;
  /// Where a turn of three sigmas moves blocks out of the coarse gate and the expected start fits
  /// less than this or leaves a direction open, other starts are tried: not turning, and turned
  /// about the body's z.
  double search_matched = 0.9;
  /// What another start must fit more to be believed: mean robust weight of the blocks.
  double search_gain = 0.05;
  /// Beside wheels the image alone must tell the other place from theirs (5 sigmas), and it must be
  /// one where a wheel that slips may take a body: turned, and moved by no more than half the track
  /// (m) times the turn.
  double observed_chi_squared = 25, half_track = 0.5;
  MotionLimits limits;       ///< of the motion before, which the other place must keep, too
  double slide_gain = 0.02;  ///< likewise, for a place along a direction that is open
  int key_frames = 4;        ///< kept; the latest and the oldest that still overlaps are matched
  double key_overlap = 0.7;  ///< fraction of matched blocks below which a key frame is taken
  double key_translation = 0.12;  ///< of the median depth, likewise
  double key_rotation = 0.2;      ///< rad, likewise
  double old_overlap = 0.5;       ///< an older key frame this well in view is matched, too
  double lost_matched = 0.15;     ///< below: the image said nothing
  /// Change of velocity from frame to frame, 1-sigma at 30 Hz, grows with the time between (m,
  /// rad).
  double sigma_velocity = 0.02, sigma_turn = 0.02;
  double frame_time = 1.0 / 30;  ///< s, what the two above are for
  /// s, of what is not usual sideways and up, of roll and pitch; after a longer gap nothing goes
  /// on.
  double rest_time = 0.3;
  double usual_time = 0.5;  ///< s: the mean velocity of about so long is the usual one
  /// Mean robust weight of what is in view at which an image explains itself: surfaces known to
  /// their stated noise have 0.75 to 0.95, images that bend 0.2 to 0.7 wherever they are laid.
  double explained = 0.7;
  double samples_per_fact = 30;  ///< blocks whose errors are alike: correlated noise, calibration
  /// Noise of normals makes information in directions that no surface holds; what is less than this
  /// many times what their noise makes is not believed.
  double normal_noise_factor = 1.5;
  /// An image tells the heading if it leaves less than this share of the variance that was
  /// expected.
  double heading_held = 0.1;
  /// Of the best direction's information: with less, surfaces along a direction are not asked.
  double hard_share = 0.05;
  double min_information = 400;  ///< 1/m^2: a direction known worse than 5 cm is called unknown
  /// Within this time of something that moved, a motion more than so many sigmas off the expected
  /// one may be that of what moved.
  double moved_memory = 1, surprise_sigmas = 2;  ///< s
  /// What a match is off at best, per frame: m, rad, and per m or rad of motion.
  double sigma_translation = 0.0007, sigma_rotation = 0.0004, sigma_motion = 0.01;
};

struct DepthMotion {
  SE3 T_prev_curr_body;
  Matrix6d covariance = Matrix6d::Zero();  ///< right tangent (translation, rotation)
  /// Of the image alone, against the key frames it was matched with (body tangent); and information
  /// times what the image alone is off the motion given, which the expected motion pulls to itself.
  Matrix6d image_information = Matrix6d::Zero();
  Vector6d image_pull = Vector6d::Zero();
  ScanMotion::Status status = ScanMotion::Status::kFirst;
  int unknown_directions = 0;  ///< of six, that the image left open
  double matched = 0;          ///< fraction of oriented blocks that fit the key frame
  double rms = 0;              ///< m, of those
  double moving = 0;           ///< fraction of oriented blocks that cannot have stood still
  bool doubtful = false;       ///< may be the motion of what moved; the covariance allows for it
  /// Blocks in view of the key frame agree with it as their stated noise has it, where the image
  /// was laid: images that bend do so nowhere, and contradict nothing.
  bool explained = false;
  /// rad: turn that was assumed, and its 1-sigma, since an image last told the heading. 0 where
  /// this one does.
  double heading_guessed = 0;
  bool key_frame = false;  ///< this frame became one
  /// The image tells clearly another motion than wheels: m and rad that these are off; 0: it does
  /// not.
  double against_wheels_m = 0, against_wheels_rad = 0;
};

/// Projective association, Gauss-Newton on point-to-plane distances weighted by the disparity noise
/// of both frames, coarse to fine; the start is `guess` or constant velocity, which is also a prior
/// that decides where the surfaces leave a direction open (one wall, a corridor whose end is out of
/// range). After a long gap (UsualFit) an image that fits worse than usual or leaves a direction
/// open is not believed. What cannot have stood still (moving_blocks) says nothing of the motion
/// and does not become part of key frames. [Chen1992], [Newcombe2011]. Deterministic.
class DepthOdometry {
 public:
  explicit DepthOdometry(const DepthOdometryOptions& options = {});
  DepthMotion process(const DepthFrame& frame, const std::optional<MotionGuess>& guess = {});
  const DepthOdometryOptions& options() const { return options_; }

  /// For archives (models/archive.hpp): all that one call leaves to the next.
  template <class A>
  friend void fields(A& a, DepthOdometry& v) {
    a(v.keys_, v.T_world_camera_, v.velocity_, v.last_stamp_, v.usual_, v.turn_guessed_,
      v.turn_variance_, v.last_moving_, v.usual_velocity_);
  }

 private:
  struct KeyFrame {
    SE3 T_world_camera;
    DepthBlocks blocks;
    double median_depth = 1;
    template <class A>
    friend void fields(A& a, KeyFrame& v) {
      a(v.T_world_camera, v.blocks, v.median_depth);
    }
  };
  struct Expectation;
  struct Alignment;
  /// `dt`: s since the last image.
  Expectation expect(double dt, const SE3& T_body_camera,
                     const std::optional<MotionGuess>& guess) const;
  /// T_prev_curr of the camera when the body goes on as it did.
  SE3 going_on(double dt, const SE3& T_body_camera) const;
  Alignment aligned_as_expected(const DepthBlocks& current, const Expectation& expected) const;
  /// An alignment that began from a guess fits worse than usual, or worse than if the turn had not
  /// been: a wheel may have slipped.
  bool contradicted(const DepthBlocks& current, const Alignment& alignment) const;
  /// Wheels that slip, stand while the body moves, or drive on while it stands: where the image,
  /// laid without them, tells clearly another place, that place and the last motion's sureness take
  /// theirs. True where they did.
  bool overrule(const DepthBlocks& current, Expectation& expected, Alignment& alignment) const;
  /// The image may contradict wheels: its blocks pull away from where they say, or fit badly there.
  bool pulls_away(const DepthBlocks& current, const Expectation& expected,
                  const Alignment& alignment) const;
  /// Where the image was taken: aligned as expected, from other starts where that fits badly (with
  /// a guess: where it is contradicted, which is doubted then), and moved along what slopes leave
  /// open.
  Alignment locate(const DepthBlocks& current, const SE3& T_body_camera,
                   Expectation& expected) const;
  /// Of the motion between two images (camera frame): alignment, expectation, and what a match is
  /// off at best.
  Matrix6d covariance_of(const Alignment& alignment, const Expectation& expected,
                         const SE3& T_prev_curr) const;
  void align(const DepthBlocks& current, const SE3& predicted, const Matrix6d& prior,
             Alignment& alignment, int coarse_iterations, int fine_iterations) const;
  /// An image laid there would have the body leave its motion as no robot can, beside wheels that
  /// go on with it (MotionLimits).
  bool breaks_off(const Expectation& expected, const SE3& T_world_camera) const;
  /// Of other starts (T_world_camera) the best, if it is clearly better than the alignment.
  std::optional<SE3> search(const DepthBlocks& current, const Expectation& expected,
                            const SE3& T_body_camera, const std::vector<SE3>& starts,
                            const Alignment& alignment) const;
  /// By how much the current image's blocks fit the latest key frame better at one pose than at
  /// another, of those in view at both.
  double gain(const DepthBlocks& current, const SE3& from, const SE3& to) const;
  /// DepthMotion::explained.
  bool explains(const DepthBlocks& current, const SE3& T_world_camera) const;
  /// The image at `b` alone says that it was not taken at `a`, and slipping may explain it.
  bool slipped(const Alignment& a, const Alignment& b, const SE3& T_body_camera) const;
  /// Where the surfaces are too few or too like to tell by their slopes, places along the open
  /// directions may still fit more: within two sigmas of what was expected the best is taken, if it
  /// gains slide_gain (1 + sigmas^2).
  void slide(const DepthBlocks& current, const Matrix6d& prior, Alignment& alignment) const;
  std::vector<SE3> other_starts(const SE3& predicted, const SE3& T_body_camera,
                                double sigma_turn) const;
  /// Fraction of blocks that fit the latest key frame at this pose.
  double fit(const DepthBlocks& current, const SE3& T_world_camera) const;
  std::vector<const KeyFrame*> references(const DepthBlocks& current,
                                          const SE3& T_world_camera) const;
  float surface_variance() const {
    return static_cast<float>(options_.surface_sigma * options_.surface_sigma);
  }
  /// Takes what cannot have stood still out of the image and the latest key frame: no part of it
  /// may say how the camera moved. Returns its share of both.
  double drop_what_moved(DepthBlocks& current, const SE3& T_world_camera);
  /// Something moved of late, and the step comes as a surprise.
  bool contradictions(const Expectation& expected, const SE3& T_prev_curr, Timestamp stamp) const;
  /// Sums up what DepthMotion::heading_guessed says.
  double guessed_heading(const DepthMotion& motion, double expected_variance);
  void keep_key_frame(DepthBlocks blocks, bool lost, DepthMotion& motion);

  DepthOdometryOptions options_;
  std::deque<KeyFrame> keys_;
  SE3 T_world_camera_;                    ///< of the last frame
  Vector6d velocity_ = Vector6d::Zero();  ///< camera tangent per second
  /// m/s, body frame: mean over `usual_time`, of steps that images told in all directions.
  Eigen::Vector3d usual_velocity_ = Eigen::Vector3d::Zero();
  std::optional<Timestamp> last_stamp_;
  UsualFit usual_;
  std::optional<Timestamp> last_moving_;         ///< when something was last seen to move
  double turn_guessed_ = 0, turn_variance_ = 0;  ///< rad, rad^2, since the heading was told
};

}  // namespace lamina
