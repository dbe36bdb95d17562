"""The engine of flyreg: lay the surface of one fly brain on another.

The stages in the order they run, each remembered: `preparation.Preparation` calls those that make a
pair of brains ready, `pipeline.Pipeline.run` those from the landmarks on.

=======================  ======================  ==================================================
stage                    module                  what goes in -> what comes out
=======================  ======================  ==================================================
read                     brain_files             file or template -> surface in micrometres
pose                     pose, alignment         surface -> the animal's axes; source against target
solid                    solid                   any triangles -> voxels inside or outside
shape                    shape_map               two surfaces -> smooth map of space
trim                     trim, matching          solid -> solid without the optic lobes
tunnels                  carve, handles          solid -> solid with exactly one handle
torus                    torus, pockets,         solid -> closed surface, pockets filled, back on the
                         isosurface              original
simplify (optional)      simplify                closed surface -> the same with fewer vertices
smooth                   smooth                  surface -> smoothed vertices, which decide the cut
two halves               cut, relabel            surface -> two rings and two caps, sharing edges
five named curves        boundary                rings -> upper, lower, left, right, hole
flat                     flatten, halves         ring -> strip, shown as a rectangle with a hole
laid over                lay_over                flat source -> flat source that lies as the target
detail                   match_detail, divide    flat brains -> more faces where each needs them
landmark pairs           correspondence,         curves, shape and the user's pairs -> places in
                         suggestions             the plane
weighted spline          thin_plate_spline,      places, weights, lambda -> map of the plane;
                         live_spline             the same under the hand, from what was solved
boundary, folds          boundary_map, unfold    map -> one-to-one map from strip to strip
lift, sew                lift, caps              strip -> registered surface, closed
distances                surface_distance        two surfaces -> mean, RMS, Hausdorff, both ways
judgement                judgement, trade_off,   landmarks -> leave-one-out errors, best lambda,
                         cross_validation        what it costs, who folds the surface
seam                     seam                    registered surface -> angle where its halves meet
report                   report, report_page     what came of it -> report.json, report.html
=======================  ======================  ==================================================

What the user decides is a `project.Project`; `edits` change it, `project_file` keeps it. Two brains
that were prepared for each other are kept on disk by `cache`. `comparison` runs other methods
(`rivals`) on the same prepared brains, each in a process of its own (`apart`).

Parts of scipy that only preparing needs are called by their full names (`scipy.ndimage.label`): so they
are imported when first used, and what is already prepared opens sooner.
"""
