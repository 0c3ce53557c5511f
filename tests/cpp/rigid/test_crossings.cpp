#include "raymortar/rigid/crossings.h"
#include <gtest/gtest.h>

namespace raymortar
{
namespace
{
Crossings slab(double entry, double exit)
{
  Crossings line;
  line.add(entry, true);
  line.add(exit, false);
  return line;
}

TEST(Crossings, APointOutsideMeetsTheFirstEntryAhead)
{
  EXPECT_EQ(slab(1.0, 2.0).entry(), 1.0);
}

TEST(Crossings, APointInsideMeetsTheEntryBehindIt)
{
  EXPECT_EQ(slab(-1.0, 2.0).entry(), -1.0);
}

TEST(Crossings, ASolidBehindThePointIsNotMet)
{
  EXPECT_FALSE(slab(-2.0, -1.0).entry());
}

TEST(Crossings, ASolidThatWasEnteredElsewhereIsNotMet)
{
  Crossings line;
  line.add(1.0, false);
  EXPECT_FALSE(line.entry());
  line.add(3.0, true); // another wall behind the exit
  EXPECT_FALSE(line.entry());
}

TEST(Crossings, WhatIsAroundAHoleIsMetFromWithinTheHole)
{
  EXPECT_EQ(slab(-1.0, 2.0).turned_inside_out().entry(), 2.0);
  EXPECT_EQ(slab(-2.0, -0.5).turned_inside_out().entry(), -0.5);
  EXPECT_FALSE(slab(1.0, 2.0).turned_inside_out().entry());
}
} // namespace
} // namespace raymortar
