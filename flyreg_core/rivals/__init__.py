"""Other methods that lay one brain on another, behind one signature, for comparison only.

Each gets the same two prepared brains, the source already where the engine's affine alignment puts
it, and its authors' settings; where a method cannot hold all points, its description says how many
it is given, and its own map carries the others.

========================  ===============================================  ==========================
module                    method                                           package
========================  ===============================================  ==========================
unmoved                   none                                             -
closest_point_methods     iterative closest points: rigid, similarity,     trimesh, small_gicp
                          affine, point to plane
normal_distributions      normal distributions transform                   -
coherent_point_drift      coherent point drift: rigid, affine, non-rigid   rustcpd
bending_mesh              optimal step non-rigid ICP                       trimesh, rtree
========================  ===============================================  ==========================

Packages that only rivals need are the extra `flyreg[rivals]`; `table.RIVALS` lists all methods.
"""
