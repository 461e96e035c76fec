// The table of claims, each scored by the same pieces.
#include <lamina/models/median.hpp>
#include <lamina/pipeline/calibration/turn_claims.hpp>

#include <algorithm>
#include <cmath>
#include <set>

namespace lamina {
namespace {

constexpr double kStep = 0.02;  // s, of the table
constexpr double kLongest = 2;  // s: of a filter; beyond, nothing would be left of what moves
constexpr int kSamples = 24;    // of a mean over time

// The wheels' heading as images that were smeared over time would show it; what came before the
// first of it is taken to be like that.
std::optional<double> smeared(const TurnTrack& wheels, Timestamp stamp, const TurnClaim& claim) {
  std::optional<double> last = wheels.at(stamp);
  if (!last) return std::nullopt;
  double sum = 0;
  for (int k = 0; k < kSamples; ++k) {
    // Quantiles of how long ago an image was taken.
    const double share = (k + 0.5) / kSamples;
    const double ago =
        claim.value * (claim.kind == TurnClaim::Kind::kSmoothed ? -std::log1p(-share) : share);
    if (const auto then = wheels.at(stamp + -ago)) last = then;
    sum += *last;
  }
  return sum / kSamples;
}

std::optional<double> heading(const TurnTrack& wheels, Timestamp stamp, const TurnClaim& claim) {
  return claim.smeared() ? smeared(wheels, stamp, claim) : wheels.at(stamp + claim.value);
}

std::vector<TurnClaim> table() {
  std::vector<TurnClaim> all;
  for (double d = -TurnClaims::kRange; d <= TurnClaims::kRange + 1e-9; d += kStep) {
    if (std::abs(d) > kStep / 2) all.push_back({TurnClaim::Kind::kOffset, d});
  }
  for (double time = 2 * kStep; time <= kLongest; time *= 1.25) {
    all.push_back({TurnClaim::Kind::kSmoothed, time});
    all.push_back({TurnClaim::Kind::kAveraged, 2 * time});
  }
  return all;
}

}  // namespace

void TurnClaims::add(Timestamp from, Timestamp to, double yaw, double sigma) {
  pieces_.push_back({from, to, yaw, sigma});
}

// Pieces that every claim says something of.
std::vector<TurnClaims::Piece> TurnClaims::within(const TurnTrack& wheels) const {
  std::vector<Piece> result;
  for (const Piece& piece : pieces_) {
    bool whole = true;
    for (const double d : {-kRange, 0.0, kRange})
      whole = whole && wheels.at(piece.from + d) && wheels.at(piece.to + d);
    if (whole) result.push_back(piece);
  }
  return result;
}

// Costs of the pieces, where the wheels turn too much or too little by the share that fits most.
std::vector<double> TurnClaims::costs(const std::vector<Piece>& pieces, const TurnTrack& wheels,
                                      const TurnClaim& claim) const {
  std::vector<double> turned, ratios;
  for (const Piece& piece : pieces) {
    const auto from = heading(wheels, piece.from, claim), to = heading(wheels, piece.to, claim);
    turned.push_back(*to - *from);
    if (std::abs(turned.back()) > options_.turning) ratios.push_back(piece.yaw / turned.back());
  }
  double scale = 1;
  if (ratios.size() >= options_.least_pairs) {
    scale = median(ratios);
  }
  std::vector<double> result;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const double turn = scale * turned[i], off = pieces[i].yaw - turn;
    // Half of what wheels of unknown scale are off by.
    const double wheels_sigma = std::hypot(options_.sigma_turn, options_.sigma_share * turn) / 2;
    const double sigma = std::hypot(pieces[i].sigma, wheels_sigma);
    result.push_back(std::min(options_.most_cost, off * off / (sigma * sigma)));
  }
  return result;
}

void TurnClaims::score(const std::vector<Piece>& pieces, const TurnTrack& wheels,
                       TurnClaim& claim) const {
  claim.cost = claim.kind == TurnClaim::Kind::kAsStated ? 0 : options_.simpler;
  for (const double cost : costs(pieces, wheels, claim)) claim.cost += cost;
}

bool TurnClaims::contradicted(const TurnTrack& wheels) const {
  TurnClaim stated;
  score(within(wheels), wheels, stated);
  return stated.cost > options_.least_gain;
}

std::optional<TurnClaims::Found> TurnClaims::found(const TurnTrack& wheels) const {
  const std::vector<Piece> pieces = within(wheels);
  Found found;
  score(pieces, wheels, found.stated);
  if (!(found.stated.cost > options_.least_gain)) return std::nullopt;
  found.best = found.stated;
  // What can be corrected, unless what cannot explains clearly more.
  const auto ask = [&](TurnClaim claim) {
    score(pieces, wheels, claim);
    const double by = claim.smeared() == found.best.smeared() ? 0
                      : claim.smeared()                       ? options_.simpler
                                                              : -options_.simpler;
    if (claim.cost + by < found.best.cost) found.best = claim;
  };
  for (const TurnClaim& claim : table()) ask(claim);
  for (double step = kStep / 2; found.best.value != 0 && step > kStep / 8; step /= 2) {
    const TurnClaim middle = found.best;
    ask({middle.kind, middle.value - step});
    ask({middle.kind, middle.value + step});
  }
  std::set<int> stretches;
  const auto before = costs(pieces, wheels, found.stated);
  const auto after = costs(pieces, wheels, found.best);
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    if (before[i] - after[i] < options_.agrees) continue;
    ++found.mended;
    stretches.insert(static_cast<int>((pieces[i].from - pieces.front().from) / (2 * kLongest)));
  }
  found.turns = stretches.size();
  const bool observed = found.best.cost + options_.least_gain < found.stated.cost &&
                        found.mended >= options_.least_pairs / 2 && found.turns >= 3;
  return observed ? std::optional(found) : std::nullopt;
}

}  // namespace lamina
