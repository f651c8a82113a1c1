"""VTK's volume mappers in a window: the scene, colours, maxima and depths. For peers_points.py."""
import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy


def vtk_image(samples, spacing):
    image = vtk.vtkImageData()
    image.SetDimensions(samples.shape[::-1])
    image.SetSpacing(*spacing)
    image.GetPointData().SetScalars(numpy_to_vtk(samples.reshape(-1), deep=True))
    return image


def volume_property(opacity, color):
    result = vtk.vtkVolumeProperty()
    opacities, colors = vtk.vtkPiecewiseFunction(), vtk.vtkColorTransferFunction()
    for point in opacity:
        opacities.AddPoint(*point)
    for point in color:
        colors.AddRGBPoint(*point)
    result.SetScalarOpacity(opacities)
    result.SetColor(colors)
    result.SetScalarOpacityUnitDistance(1.0)
    result.SetInterpolationTypeToLinear()
    return result


def make_mapper(kind, image, step_mm):
    if kind == "gpu":
        mapper = vtk.vtkGPUVolumeRayCastMapper()
        mapper.UseJitteringOff()
    else:
        mapper = vtk.vtkFixedPointVolumeRayCastMapper()
    mapper.AutoAdjustSampleDistancesOff()
    mapper.LockSampleDistanceToInputSpacingOff()
    mapper.SetImageSampleDistance(1.0)
    mapper.SetSampleDistance(step_mm)
    mapper.SetInputData(image)
    return mapper


class Stage:
    """One window and one volume; `view` is a camera: eye, target, up and view_angle_deg. The volume
    is not yet in the scene, as whoever times a first frame wants to put it there."""

    def __init__(self, view, mapper, size):
        self.window = vtk.vtkRenderWindow()
        self.window.SetOffScreenRendering(1)
        self.window.SetMultiSamples(0)
        self.renderer = vtk.vtkRenderer()
        self.window.AddRenderer(self.renderer)
        self.mapper = mapper
        self.volume = vtk.vtkVolume()
        self.volume.SetMapper(mapper)
        self.view = view
        self.camera = self.renderer.GetActiveCamera()
        self.resize(size)
        self.window.Render()

    def resize(self, size):
        """Another size, and the camera back where it began."""
        self.size = size
        self.window.SetSize(size, size)
        self.camera.SetPosition(*self.view["eye"])
        self.camera.SetFocalPoint(*self.view["target"])
        self.camera.SetViewUp(*self.view["up"])
        self.camera.SetViewAngle(self.view["view_angle_deg"])
        self.renderer.ResetCameraClippingRange()

    def draw(self, look):
        """Colours 0 .. 1, row 0 at the top."""
        self.volume.SetProperty(look)
        self.window.Render()
        pixels = vtk.vtkUnsignedCharArray()
        self.window.GetPixelData(0, 0, self.size - 1, self.size - 1, 0, pixels, 0)
        return vtk_to_numpy(pixels).reshape(self.size, self.size, 3)[::-1] / 255.0

    def close(self):
        self.renderer.RemoveVolume(self.volume)
        self.volume.ReleaseGraphicsResources(self.window)
        self.window.Finalize()


def maximum(stage, least, most, window_hu):
    """The maximum of each ray, for volumes of values between least and most. VTK gives 8-bit
    pictures, so it is read through windows of window_hu."""
    stage.mapper.SetBlendModeToMaximumIntensity()
    result = np.full((stage.size, stage.size), np.nan)
    # Windows overlap, and the middle half of each counts: the ends are rounded by VTK's table.
    for low in range(int(least) - window_hu, int(most), window_hu // 2):
        # Opaque throughout, grey across the window alone: 0 below it, 1 above.
        look = volume_property([(-2000, 1), (4000, 1)],
                               [(low, 0, 0, 0), (low + window_hu, 1, 1, 1)])
        grey = stage.draw(look)[..., 0]
        inside = (grey >= 0.25) & (grey < 0.75)
        result[inside] = low + window_hu * grey[inside]
    return result


def surface_depth(stage, look):
    """Distance from the eye in mm where the depth picture of the GPU mapper has one."""
    stage.mapper.SetRenderToImage(1)
    stage.volume.SetProperty(look)
    stage.window.Render()
    image = vtk.vtkImageData()
    stage.mapper.GetDepthImage(image)
    stage.mapper.SetRenderToImage(0)
    size = stage.size
    depth = vtk_to_numpy(image.GetPointData().GetScalars()).reshape(size, size)[::-1]
    depth = depth.astype(float)
    near, far = stage.camera.GetClippingRange()
    along_axis = near * far / (far - depth * (far - near))
    tangent = np.tan(np.radians(stage.view["view_angle_deg"] / 2))
    place = tangent * ((np.arange(size) + 0.5) / size * 2 - 1)
    result = along_axis * np.sqrt(1 + place[None, :]**2 + place[:, None]**2)
    result[(depth <= 0) | (depth >= 1)] = np.nan
    return result
