// The inner loops of depth_scan.cpp; see every_instruction_set.h. All functions are inlined into
// `draw_tree` and `draw_solids`. Function templates of other headers must not be used: the linker
// could choose a copy compiled for an instruction set that the processor lacks.
//
// EdgeKernel and SolidKernel draw shapes. Both derive from BoxKernel, which derives from RayKernel.
// Only this file includes the files of these classes.

#include "rays/box_kernel.h"
#include "rays/edge_kernel.h"
#include "rays/solid_kernel.h"

void set_frame(const ScanView& scan, const ScanFrame& frame, const b2Transform& body) {
  RayKernel<false>{scan, frame, nullptr}.set_frame(body);
}

void draw_tree(const ScanView& scan, const ScanFrame& frame, const EdgeTree::Node* nodes,
               const EdgeTree::Leaf* leaves) {
  const EdgeKernel<false> kernel{{{scan, frame, nullptr}}};
  kernel.traverse(nodes, 1.0F, [&](std::uint32_t leaf, Interval rays) {
    kernel.draw_leaf(leaves[leaf], nullptr, rays);
  });
}

void find_in_tree(const ScanView& scan, const ScanFrame& frame, const HitView& hits,
                  const EdgeTree::Node* nodes, const EdgeTree::Leaf* leaves,
                  const EdgeTree::LeafFixtures* fixtures) {
  const EdgeKernel<true> kernel{{{scan, frame, &hits}}};
  kernel.traverse(nodes, 1.0F, [&](std::uint32_t leaf, Interval rays) {
    kernel.draw_leaf(leaves[leaf], fixtures + leaf, rays);
  });
}

template <bool kFindsFixtures>
FLATLAND_INLINE void draw_all(const SolidKernel<kFindsFixtures>& kernel, const SolidView& solids) {
  for (std::size_t i = 0; i < solids.loose_count; ++i) kernel.draw_group(solids.loose[i]);
  if (solids.nodes == nullptr) return;
  kernel.traverse(solids.nodes, kCircleRounding,
                  [&](std::uint32_t leaf, Interval) { kernel.draw_group(solids.groups[leaf]); });
}

void draw_solids(const ScanView& scan, const ScanFrame& frame, const SolidView& solids) {
  draw_all(SolidKernel<false>{{{scan, frame, nullptr}}}, solids);
}

void find_in_solids(const ScanView& scan, const ScanFrame& frame, const HitView& hits,
                    const SolidView& solids) {
  draw_all(SolidKernel<true>{{{scan, frame, &hits}}}, solids);
}

constexpr Functions kFunctions{set_frame, draw_tree, draw_solids, find_in_tree, find_in_solids};
