"""Against scikit-image: surfaces, label statistics, threshold of components."""

import numpy as np
import skimage.measure

import palpate


def test_surfaces_have_the_same_vertices_and_area(ball):
    mesh = palpate.surface(ball, 100.0)
    vertices, faces, _, _ = skimage.measure.marching_cubes(ball.to_numpy(), 100.0, method="lorensen")
    theirs = vertices @ ball.affine[:3, :3].T + ball.affine[:3, 3]
    # Both interpolate linearly along the grid's edges, in floats of about 1e-7 of 20 mm.
    ours = mesh.vertices
    distance = np.linalg.norm(ours[:, None, :] - theirs[None, :, :], axis=-1)
    assert distance.min(axis=0).max() < 1e-4 and distance.min(axis=1).max() < 1e-4
    # Quadrilaterals may be split along the other diagonal: areas agree to second order in h / r = 2 / 10.
    def area(points, triangles):
        a, b, c = (points[triangles[:, i]] for i in range(3))
        return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()

    one, other = area(ours, np.asarray(mesh.triangles)), area(theirs, faces)
    assert abs(one - other) < 0.04 * other


def test_label_statistics_agree(ball):
    rng = np.random.default_rng(3)
    blobs = palpate.filter(palpate.Volume.from_numpy(rng.normal(size=(40, 50, 20)).astype(np.float32), ball.affine), "gaussian", 2.0)
    labels = skimage.measure.label(blobs.to_numpy() > 0.08, connectivity=1).astype(np.uint16)
    assert 2 < labels.max() < 200
    found = palpate.measure(ball, labels=palpate.Volume.from_numpy(labels, ball.affine))["labels"]
    theirs = skimage.measure.regionprops(labels, intensity_image=ball.to_numpy())
    assert len(found) == len(theirs)
    for ours, region in zip(found, theirs):
        assert ours["label"] == region.label and ours["count"] == region.area
        world = ball.affine[:3, :3] @ region.centroid + ball.affine[:3, 3]
        assert np.allclose(ours["centroid_mm"], world, atol=1e-6)
        assert np.isclose(ours["values"]["mean"], region.intensity_mean, rtol=1e-5, atol=1e-4)


def test_components_agree(ball):
    rng = np.random.default_rng(5)
    mask = rng.random((40, 50, 20)) < 0.2
    volume = palpate.Volume.from_numpy(mask.astype(np.uint8), ball.affine)
    for neighbours, connectivity in ((6, 1), (26, 3)):
        largest = palpate.filter(volume, "largest", neighbours, labels=True).to_numpy()
        sizes = np.bincount(skimage.measure.label(mask, connectivity=connectivity).ravel())[1:]
        assert (largest > 0).sum() == sizes.max()
