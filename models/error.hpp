// Errors: lamina::Error for the user's input, LAMINA_CHECK for promises broken inside.
#pragma once

#include <stdexcept>
#include <string>

namespace lamina {

/// The user's input or usage is at fault. what() is one line that names the file, the place, what
/// was found and what was expected; programs print it and exit with 2.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Builds the one line "FILE:PLACE: found FOUND, expected EXPECTED". Empty parts are left out.
Error input_error(const std::string& file, const std::string& place, const std::string& found,
                  const std::string& expected);

namespace detail {
[[noreturn]] void check_failed(const char* condition, const char* file, int line);
}  // namespace detail

}  // namespace lamina

/// Throws std::logic_error when a promise inside the library is broken. Always on.
#define LAMINA_CHECK(condition)                                       \
  do {                                                                \
    if (!(condition)) {                                               \
      ::lamina::detail::check_failed(#condition, __FILE__, __LINE__); \
    }                                                                 \
  } while (false)
