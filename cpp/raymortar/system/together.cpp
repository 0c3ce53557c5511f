#include "raymortar/system/together.h"
#include "raymortar/core/error.h"
#include <string>

namespace raymortar
{
namespace
{
std::string message_of(const std::exception_ptr& failure)
{
  try
  {
    std::rethrow_exception(failure);
  }
  catch (const std::exception& error)
  {
    return error.what();
  }
  catch (...)
  {
    return "unknown failure";
  }
}
} // namespace

bool everywhere(MPI_Comm comm, bool here)
{
  int size = 1, all = here ? 1 : 0;
  MPI_Comm_size(comm, &size);
  if (size > 1)
    MPI_Allreduce(MPI_IN_PLACE, &all, 1, MPI_INT, MPI_MIN, comm);
  return all == 1;
}

void raise_together(MPI_Comm comm, const std::exception_ptr& failure)
{
  int size = 1, rank = 0;
  MPI_Comm_size(comm, &size);
  MPI_Comm_rank(comm, &rank);
  if (size == 1 and failure)
    std::rethrow_exception(failure);
  if (size == 1)
    return;
  int first = failure ? rank : size;
  MPI_Allreduce(MPI_IN_PLACE, &first, 1, MPI_INT, MPI_MIN, comm);
  if (first == size)
    return;
  std::string text = first == rank ? message_of(failure) : std::string();
  int length = static_cast<int>(text.size());
  MPI_Bcast(&length, 1, MPI_INT, first, comm);
  text.resize(static_cast<std::size_t>(length));
  MPI_Bcast(text.data(), length, MPI_CHAR, first, comm);
  throw Error(text + " (rank " + std::to_string(first) + ")");
}
} // namespace raymortar
