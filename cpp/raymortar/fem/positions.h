// Positions in a matrix of the blocks of pairs of facets: looked up once.
#pragma once

#include "raymortar/fem/aij.h"
#include "raymortar/fem/petsc.h"
#include "raymortar/fem/zone.h"

namespace raymortar
{
/// @brief Unknowns of an element in groups with consecutive rows: the
/// components of one node, or every unknown by itself.
struct NodeGroups
{
  std::vector<int> begin; ///< first entry in the element's rows
  std::vector<int> width; ///< components

  [[nodiscard]] std::size_t size() const { return begin.size(); }
};

/// @brief Cached places of the element blocks of one zone in one matrix.
///
/// An entry costs one number per pair of nodes, whatever their components,
/// where the components of each node have consecutive rows; else one per pair
/// of unknowns. They are kept until the matrix is another or has another
/// pattern.
class BlockPositions
{
public:
  /// @brief Forget everything if A's pattern is not the one known.
  void follow(PetscMatrix A, const Zone& zone);

  /// @brief Forget everything: the matrix has been preallocated anew, which
  /// newer PETSc does not count as another pattern where it is parallel.
  void forget() { _matrix = 0; }

  /// @brief Places of one element's block.
  struct Block
  {
    const NodeGroups* groups;
    /// (row group, column group): see AijArrays::find; foreign in the first
    /// column of rows of other ranks
    const std::int32_t* places;
    bool known;       ///< false: entries are missing
    bool has_foreign; ///< some rows belong to other ranks
  };

  static constexpr std::int32_t foreign = AijArrays::no_entry;

  /// @param[in] master Fetched master facet, or no_index
  [[nodiscard]] Block of(const AijArrays& A, const Zone& zone, Index slave,
                         Index master);

  /// @brief Blocks that had to be looked up since creation.
  [[nodiscard]] std::int64_t lookups() const { return _lookups; }

private:
  /// Blocks of one slave facet form a chain: there are few
  struct Entry
  {
    GlobalIndex master;
    std::int64_t begin; ///< into _places, -1: not known
    std::int32_t next;
    bool has_foreign;
    bool by_node; ///< false: unknown by unknown
  };

  /// Unknowns of an element with and without a master
  struct Groups
  {
    NodeGroups alone, paired;
    [[nodiscard]] const NodeGroups& of(Index master) const
    {
      return master == no_index ? alone : paired;
    }
  };

  [[nodiscard]] Entry look_up(const AijArrays& A, const Zone& zone, Index slave,
                              Index master);
  [[nodiscard]] bool append_places(const AijArrays& A, const NodeGroups& groups,
                                   Entry& entry);
  void set_groups(const Zone& zone);

  PetscObjectId _matrix = 0;
  PetscObjectState _pattern = -1;
  Groups _nodes, _unknowns;
  std::vector<std::int32_t> _first; ///< of each slave facet's chain
  std::vector<Entry> _entries;
  std::vector<std::int32_t> _places;
  std::vector<PetscInt> _rows;
  std::int64_t _lookups = 0;
};

/// @brief Add a row-major block to the entries of a matrix.
/// @param[in] rows Global rows of the element, -1 where row and column are
/// left out, (size,)
void add_block(const AijArrays& A, const BlockPositions::Block& at,
               std::span<const PetscInt> rows, const double* block);
} // namespace raymortar
