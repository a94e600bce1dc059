"""Arrays as image files that the program reads."""
import numpy


def save_image(file, image):
    """Writes an array of shape (height, width, 3 or 6) as the program reads it. Raises ValueError, TypeError."""
    array = numpy.asarray(image)
    if array.ndim != 3 or array.shape[2] not in (3, 6):
        raise ValueError(f"an image of shape {array.shape}; give (height, width, 3), or 6 with variances behind")
    if array.dtype.kind != "f":
        raise TypeError(f"an image of {array.dtype}; give linear radiance as floats")
    numpy.save(file, numpy.ascontiguousarray(array, numpy.float64 if array.dtype == numpy.float64 else numpy.float32))
