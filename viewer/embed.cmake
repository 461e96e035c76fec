# cmake -DSOURCE= -DBUNDLE= -DSCRIPTS= -DPAGE= -DHTML= -P embed.cmake: fills template.html with style
# and scripts, and writes the page as C++ text.
set(code "")
foreach(script IN LISTS BUNDLE SCRIPTS)
  file(READ ${script} text)
  string(APPEND code "<script>\n${text}\n</script>\n")
endforeach()
file(READ ${SOURCE}/style.css style)
file(READ ${SOURCE}/template.html html)
string(REPLACE "@LAMINA_STYLE@" "${style}" html "${html}")
string(REPLACE "@LAMINA_CODE@" "${code}" html "${html}")
file(WRITE ${HTML} "${html}")

# One literal after another: compilers take pieces of 16 kB, and join them.
string(LENGTH "${html}" length)
set(literals "")
set(at 0)
while(at LESS length)
  string(SUBSTRING "${html}" ${at} 8000 piece)
  string(APPEND literals "R\"lamina~(${piece})lamina~\"\n")
  math(EXPR at "${at} + 8000")
endwhile()
file(WRITE ${PAGE} "// The page, put together from viewer/ at build time.
#include <lamina/viewer/page.hpp>

namespace lamina::viewer {

std::string_view page_template() {
  static constexpr char kPage[] =
${literals};
  return {kPage, sizeof(kPage) - 1};
}

}  // namespace lamina::viewer
")
