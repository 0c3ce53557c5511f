// Failures that all ranks raise alike.
#pragma once

#include <exception>
#include <mpi.h>

namespace raymortar
{
/// @brief Whether a condition holds on all ranks. Collective.
[[nodiscard]] bool everywhere(MPI_Comm comm, bool here);

/// @brief Throw on all ranks what the first rank that failed has thrown.
/// Collective.
///
/// A rank that failed alone would leave the others waiting in their next
/// collective call.
/// @param[in] failure Of this rank; null: none
void raise_together(MPI_Comm comm, const std::exception_ptr& failure);

/// @brief Call something, and throw on all ranks what one rank throws.
/// Collective.
template <class Call>
void together(MPI_Comm comm, Call&& call)
{
  std::exception_ptr failure;
  try
  {
    call();
  }
  catch (...)
  {
    failure = std::current_exception();
  }
  raise_together(comm, failure);
}
} // namespace raymortar
