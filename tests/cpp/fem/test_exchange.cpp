#include "ranks.h"
#include "raymortar/fem/exchange.h"
#include <gtest/gtest.h>
#include <set>

using namespace raymortar;
using namespace raymortar::test;

namespace
{
constexpr int kinds = 3;
const MPI_Comm comm = MPI_COMM_WORLD;

/// Items of a kind that one rank sends to another: known to all, so that each
/// can tell what it must receive. Some pairs of ranks have nothing to tell
std::int64_t count(int from, int to, int kind)
{
  return (from + 2 * to) % 3 == 1 ? 0 : (2 + 3 * from + to + 5 * kind) % 4;
}

/// The i-th value of one rank for another
template <class T>
T item(int from, int to, int kind, std::int64_t i)
{
  return static_cast<T>(1000 * (100 * from + 10 * to + kind) + i);
}

template <class T>
void append_items(int from, int to, int kind, int width, std::vector<T>& items)
{
  for (std::int64_t i = 0; i < count(from, to, kind) * width; ++i)
    items.push_back(item<T>(from, to, kind, i));
}

class ExchangeOnRanks : public testing::Test
{
protected:
  static void SetUpTestSuite() { start_petsc(); }

  ExchangeOnRanks() : _rank(rank_of(comm)), _size(size_of(comm)) {}

  /// To all ranks with something to be told, this one among them
  [[nodiscard]] Exchange exchange() const
  {
    std::vector<int> ranks;
    std::vector<std::int64_t> counts;
    for (int to = 0; to < _size; ++to)
      if ((_rank + 2 * to) % 3 != 1)
      {
        ranks.push_back(to);
        for (int kind = 0; kind < kinds; ++kind)
          counts.push_back(count(_rank, to, kind));
      }
    return {comm, ranks, counts, kinds};
  }

  template <class T>
  void expect_arrival(const Exchange& over, int kind, int width) const
  {
    std::vector<T> sent, expected;
    for (int other = 0; other < _size; ++other)
    {
      append_items(_rank, other, kind, width, sent);
      append_items(other, _rank, kind, width, expected);
    }
    EXPECT_EQ(over.send(std::span<const T>(sent), kind, width), expected);
  }

  int _rank, _size;
};
} // namespace

TEST_F(ExchangeOnRanks, ItemsOfEachKindArriveByAscendingRank)
{
  const Exchange over = exchange();
  for (int again = 0; again < 2; ++again)
    for (int kind = 0; kind < kinds; ++kind)
      for (const int width : {1, 3})
      {
        expect_arrival<double>(over, kind, width);
        expect_arrival<std::int64_t>(over, kind, width);
      }
}

TEST_F(ExchangeOnRanks, CountsWhatIsSentToOthers)
{
  const Exchange over = exchange();
  // The number of items of each kind goes to every partner
  Traffic expected;
  for (int to = 0; to < _size; ++to)
    if (to != _rank and (_rank + 2 * to) % 3 != 1)
      expected += {1, 8 * kinds};
  EXPECT_EQ(over.traffic().messages, expected.messages);
  EXPECT_EQ(over.traffic().bytes, expected.bytes);
  expect_arrival<double>(over, 1, 2);
  for (int to = 0; to < _size; ++to)
    if (const std::int64_t n = count(_rank, to, 1); to != _rank and n > 0)
      expected += {1, 8 * 2 * n};
  EXPECT_EQ(over.traffic().messages, expected.messages);
  EXPECT_EQ(over.traffic().bytes, expected.bytes);
}

TEST_F(ExchangeOnRanks, NobodyNeedsToSend)
{
  const Exchange none(comm, {}, {}, 1);
  EXPECT_TRUE(none.send(std::span<const double>(), 0, 4).empty());
  EXPECT_EQ(none.traffic().messages, 0);
}

TEST_F(ExchangeOnRanks, CommunicatorIsNotTheUsersAndItsTagsAreNew)
{
  const PrivateComm own(comm), same(comm);
  int relation = MPI_UNEQUAL;
  MPI_Comm_compare(own.get(), comm, &relation);
  EXPECT_EQ(relation, MPI_CONGRUENT);
  std::set<int> tags;
  for (int k = 0; k < 3; ++k)
  {
    tags.insert(own.new_tag());
    tags.insert(same.new_tag());
  }
  EXPECT_EQ(tags.size(), 6u);
}
