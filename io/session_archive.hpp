// How the parts of a session are archived.
#pragma once

#include <lamina/grid/evidence/looks_archive.hpp>
#include <lamina/io/figure_names.hpp>
#include <lamina/io/session.hpp>

namespace lamina::io {

template <class A>
void fields(A& a, SessionPart& v) {
  a(v.name, v.first, v.last, v.shift_ns);
}

}  // namespace lamina::io

namespace lamina {

template <class A>
void fields(A& a, Figures& v) {
  std::map<std::string, double> named = io::by_name(v);
  a(named);
  if constexpr (A::kReading) v = io::figures_of(named);
}

}  // namespace lamina
