// Elements whose slave facet meets a rigid body that is free.
#pragma once

#include "raymortar/element/assembler.h"
#include "raymortar/target/freedom.h"

namespace raymortar
{
/// @brief Tool whose unknowns an element has, no_index: none.
[[nodiscard]] inline Index free_tool_of(const ContactState& s,
                                        std::size_t element)
{
  const Index k = s.has_tools() ? s.elements.master[element] : no_index;
  return k != no_index and freedom_of(s.tools[static_cast<std::size_t>(k)])
             ? k
             : no_index;
}

/// @brief What an element has unknowns of besides the slave: a master facet, or
/// a free tool; no_index: neither.
[[nodiscard]] inline Index target_of(const ContactState& s, std::size_t element)
{
  return s.has_tools() ? free_tool_of(s, element) : s.elements.master[element];
}

/// @brief How a tool of `free_tool_of` is free.
[[nodiscard]] inline const Freedom& freedom_of(const ContactState& s,
                                               Index tool)
{
  return *freedom_of(s.tools[static_cast<std::size_t>(tool)]);
}
} // namespace raymortar
