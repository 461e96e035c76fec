// The page without its data, compiled in (generated at build time from template.html).
#pragma once

#include <string_view>

namespace lamina::viewer {

/// Stands once in the page, where the data goes.
inline constexpr std::string_view kDataMark = "@LAMINA_DATA@";

/// The policy that lets the page load nothing.
inline constexpr std::string_view kPolicyMark = "default-src 'none'";

std::string_view page_template();

}  // namespace lamina::viewer
