// Turns that images show against those of the wheels: are stamps off, or images smeared over time?
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <lamina/pipeline/calibration/scanner_check.hpp>
#include <lamina/pipeline/calibration/turn_track.hpp>

namespace lamina {

/// One row of the table: what a camera's images may be, beside what is stated of them.
struct TurnClaim {
  enum class Kind {
    kAsStated,
    kOffset,    ///< an image stamped t was taken at t + value (s)
    kSmoothed,  ///< images are exponential means of those before: value is the time constant (s)
    kAveraged,  ///< images are means over the last `value` seconds
  };
  Kind kind = Kind::kAsStated;
  double value = 0;  ///< s
  double cost = 0;
  bool smeared() const { return kind == Kind::kSmoothed || kind == Kind::kAveraged; }
};

/// Gathers how far the body turned between images, as these alone have it, and scores every claim
/// by one cost over all pieces: min((turn by images - s * turn by the claim)^2 / sigma^2,
/// most_cost), s the wheels' scale that fits most, and a price for the number it fits. A claim says
/// what the wheels' heading would look like: W(t + d) of late or early stamps, a mean of W over
/// times before t of a temporal filter.
class TurnClaims {
 public:
  /// Of `options` those of turns and of costs count.
  explicit TurnClaims(const ScannerCheckOptions& options = {}) : options_(options) {}
  /// `sigma` (rad): of the turn by images, and of the wheels.
  void add(Timestamp from, Timestamp to, double yaw, double sigma);
  std::size_t pieces() const { return pieces_.size(); }
  struct Found {
    TurnClaim stated, best;
    std::size_t mended = 0;  ///< pieces that fit by `best` and not as stated
    std::size_t turns = 0;   ///< 4 s long stretches that these come from
  };
  /// The images turn otherwise than stated, whatever explains it.
  bool contradicted(const TurnTrack& wheels) const;
  /// nullopt where the images go as stated, or too few turns say otherwise.
  std::optional<Found> found(const TurnTrack& wheels) const;
  static constexpr double kRange = 0.6;  ///< s: stamps further off are not looked for

 private:
  struct Piece {
    Timestamp from, to;
    double yaw, sigma;
  };
  std::vector<double> costs(const std::vector<Piece>& pieces, const TurnTrack& wheels,
                            const TurnClaim& claim) const;
  void score(const std::vector<Piece>& pieces, const TurnTrack& wheels, TurnClaim& claim) const;
  std::vector<Piece> within(const TurnTrack& wheels) const;

  ScannerCheckOptions options_;
  std::vector<Piece> pieces_;
};

}  // namespace lamina
