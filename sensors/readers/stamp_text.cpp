// Reads stamps in two ways and compares.
#include <lamina/sensors/readers/stamp_text.hpp>

#include <lamina/sensors/text.hpp>

namespace lamina {
namespace {
constexpr std::size_t kDigits = 6;  // of a microsecond
}

std::optional<StampText> read_stamp(std::string_view text) {
  StampText stamp;
  stamp.decimal = Timestamp::parse(text);
  if (!stamp.decimal) {
    // 5e-312 and 1e300 are numbers, if no times; "abc" is damage.
    const bool number = parse_number_or_special(text) ||
                        text.find("e-") != std::string_view::npos ||
                        text.find("e+") != std::string_view::npos;
    return number && !text.empty() &&
                   text.find_first_not_of("0123456789.eE+-nainftyNAIFTY") == std::string_view::npos
               ? std::optional(stamp)
               : std::nullopt;
  }
  const auto dot = text.find('.');
  const std::string_view fraction =
      dot == std::string_view::npos ? std::string_view() : text.substr(dot + 1);
  const bool padded = fraction.size() > 1 && fraction.front() == '0';
  if (padded || fraction.size() > kDigits || text.front() == '-' ||
      fraction.find_first_not_of("0123456789") != std::string_view::npos) {
    return stamp;
  }
  std::string whole(text.substr(0, dot));
  whole += "." + std::string(kDigits - fraction.size(), '0') + std::string(fraction);
  stamp.microseconds = Timestamp::parse(whole);
  return stamp;
}

void MicrosecondCheck::add(const StampText& stamp, int stream) {
  if (!stamp.decimal || !possible_) return;
  if (!stamp.microseconds) {
    possible_ = false;
    return;
  }
  ++seen_;
  if (*stamp.microseconds != *stamp.decimal) ++shorter_;
  const auto last = last_.find(stream);
  if (last != last_.end() && *stamp.decimal < last->second.first) ++back_decimal_;
  if (last != last_.end() && *stamp.microseconds < last->second.second) ++back_microseconds_;
  last_[stream] = {*stamp.decimal, *stamp.microseconds};
}

bool MicrosecondCheck::found() const {
  return possible_ && seen_ >= kEnough && shorter_ > 0 && back_microseconds_ < back_decimal_;
}

}  // namespace lamina
