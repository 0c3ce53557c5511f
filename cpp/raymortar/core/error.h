// The one exception type of the library, thrown at its outer edges only.
#pragma once

#include <stdexcept>
#include <string>

namespace raymortar
{
/// @brief Bad input or a state the method cannot continue from.
///
/// The message names the argument, the facet (global cell and local facet) or
/// the tag that is at fault. Inner stages return a status instead of throwing.
class Error : public std::runtime_error
{
public:
  explicit Error(const std::string& message) : std::runtime_error(message) {}
};
} // namespace raymortar
