// One ray on a tool.
#pragma once

#include "raymortar/target/tool.h"

namespace raymortar
{
inline ToolHit cast(const Tool& tool, const ToolRay& ray)
{
  ToolHit hit;
  tool.cast({&ray, 1}, {&hit, 1});
  return hit;
}
} // namespace raymortar
