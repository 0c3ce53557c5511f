// Messages between ranks that have something to tell each other.
#pragma once

#include <cstdint>
#include <mpi.h>
#include <span>
#include <vector>

namespace raymortar
{
/// @brief What one rank has sent to others.
struct Traffic
{
  std::int64_t messages = 0;
  std::int64_t bytes = 0;

  Traffic& operator+=(const Traffic& other)
  {
    messages += other.messages;
    bytes += other.bytes;
    return *this;
  }
};

/// @brief A communicator of the library's own over the ranks of the user's.
///
/// PETSc's private duplicate, so that no message is taken for another's.
class PrivateComm
{
public:
  explicit PrivateComm(MPI_Comm comm);
  ~PrivateComm();
  PrivateComm(const PrivateComm&) = delete;
  PrivateComm& operator=(const PrivateComm&) = delete;

  [[nodiscard]] MPI_Comm get() const { return _comm; }

  /// @brief A tag that no earlier call has returned. Collective.
  [[nodiscard]] int new_tag() const;

private:
  MPI_Comm _comm = MPI_COMM_NULL;
};

/// @brief Lists of items that ranks send to each other, again and again.
///
/// Every rank says to whom it sends; nonblocking consensus finds from whom it
/// receives, at a cost in the number of partners and the logarithm of the
/// number of ranks. Items may be of several kinds, each with a separate count
/// per partner.
class Exchange
{
public:
  /// @brief Collective.
  /// @param[in] ranks Ranks this one sends to, ascending; may hold itself
  /// @param[in] counts Items of each kind to each rank, (ranks, kinds)
  /// @param[in] kinds At most 4
  Exchange(MPI_Comm comm, std::vector<int> ranks,
           std::vector<std::int64_t> counts, int kinds);

  /// @brief Items of one kind, `width` values each. All ranks call alike.
  /// @param[in] items Rank by rank in the order of `ranks`
  /// @return items of the other ranks, by ascending rank
  [[nodiscard]] std::vector<double> send(std::span<const double> items,
                                         int kind, int width) const;
  [[nodiscard]] std::vector<std::int64_t>
  send(std::span<const std::int64_t> items, int kind, int width) const;

  /// Sent by this rank so far, without what it sent to itself
  [[nodiscard]] const Traffic& traffic() const { return _traffic; }

private:
  /// Partners and the number of items of each kind
  struct Side
  {
    std::vector<int> ranks;
    std::vector<std::int64_t> counts; ///< (ranks, kinds)
  };

  template <class T>
  std::vector<T> send_items(std::span<const T> items, int kind,
                            int width) const;
  void find_senders();

  PrivateComm _comm;
  int _kinds, _rank = 0, _tag = 0;
  Side _to, _from;
  mutable Traffic _traffic;
};
} // namespace raymortar
