// The text of errors.
#include <lamina/models/error.hpp>

namespace lamina {

Error input_error(const std::string& file, const std::string& place, const std::string& found,
                  const std::string& expected) {
  std::string text = file;
  if (!place.empty()) text += ":" + place;
  text += ": found " + found;
  if (!expected.empty()) text += ", expected " + expected;
  return Error(text);
}

namespace detail {
void check_failed(const char* condition, const char* file, int line) {
  throw std::logic_error(std::string("broken promise: ") + condition + " at " + file + ":" +
                         std::to_string(line));
}
}  // namespace detail

}  // namespace lamina
