#!/usr/bin/env python3
"""Reads a snapshot file (points.vtkhdf) with VTK's own reader and compares it with what HDF5 says is in it.

Goes through all time steps; checks the number of points, the cells and every array, and draws the last step without
a display where asked for. Exit code 0 when all is well, 1 with a message otherwise.
"""

import argparse
import sys

import h5py
import numpy
import vtk
from vtk.util.numpy_support import vtk_to_numpy

VERTEX = 1


class Wrong(Exception):
    """The file is not what it should be."""


def demand(condition, message):
    if not condition:
        raise Wrong(message)


def read_times(reader):
    """The time steps that VTK finds."""
    reader.UpdateInformation()
    information = reader.GetOutputInformation(0)
    key = vtk.vtkStreamingDemandDrivenPipeline.TIME_STEPS()
    return [information.Get(key, index) for index in range(information.Length(key))]


def check_step(grid, root, step, count):
    """One step as VTK has it against the rows of the file."""
    rows = slice(step * count, (step + 1) * count)
    demand(grid.GetNumberOfPoints() == count, f"step {step}: {grid.GetNumberOfPoints()} points instead of {count}")
    demand(grid.GetNumberOfCells() == count, f"step {step}: {grid.GetNumberOfCells()} cells instead of {count}")
    connectivity = vtk_to_numpy(grid.GetCells().GetConnectivityArray())
    demand((connectivity == numpy.arange(count)).all(), f"step {step}: cell i is not point i")
    demand(grid.GetCellType(count - 1) == VERTEX, f"step {step}: the cells are not vertices")
    compare("Points", vtk_to_numpy(grid.GetPoints().GetData()), root["Points"][rows], step)
    data = grid.GetPointData()
    demand(data.GetNumberOfArrays() == len(root["PointData"]), f"step {step}: {data.GetNumberOfArrays()} arrays")
    for name, stored in root["PointData"].items():
        array = data.GetArray(name)
        demand(array is not None, f"step {step}: VTK does not find {name}")
        compare(name, vtk_to_numpy(array), stored[rows], step)


def compare(name, seen, stored, step):
    demand(seen.shape == stored.shape, f"step {step}: {name} has shape {seen.shape} instead of {stored.shape}")
    demand(numpy.isfinite(stored).all(), f"step {step}: {name} has numbers that are not finite")
    demand((seen == stored).all(), f"step {step}: {name} differs from the file")


def draw(grid, field, path):
    """A picture of the points coloured by a field; it must show more than the background."""
    values = vtk_to_numpy(grid.GetPointData().GetArray(field))
    shown = values if values.ndim == 1 else numpy.linalg.norm(values, axis=1)
    colours = vtk.util.numpy_support.numpy_to_vtk(numpy.ascontiguousarray(shown, dtype=float), deep=True)
    colours.SetName("shown")
    grid.GetPointData().AddArray(colours)
    mapper = vtk.vtkDataSetMapper()
    mapper.SetInputData(grid)
    mapper.SetScalarModeToUsePointFieldData()
    mapper.SelectColorArray("shown")
    mapper.GetLookupTable().SetHueRange(0.667, 0.0)
    mapper.SetScalarRange(float(shown.min()), max(float(shown.max()), float(shown.min()) + 1e-30))
    actor = vtk.vtkActor()
    actor.SetMapper(mapper)
    edge = grid.GetNumberOfPoints() ** 0.5
    actor.GetProperty().SetPointSize(min(max(500.0 / edge, 3.0), 30.0))
    actor.GetProperty().RenderPointsAsSpheresOn()
    bar = vtk.vtkScalarBarActor()
    bar.SetLookupTable(mapper.GetLookupTable())
    bar.SetTitle(field)
    bar.UnconstrainedFontSizeOn()
    renderer = vtk.vtkRenderer()
    renderer.SetBackground(1.0, 1.0, 1.0)
    for text in (bar.GetTitleTextProperty(), bar.GetLabelTextProperty()):
        text.SetColor(0.0, 0.0, 0.0)
    renderer.AddActor(actor)
    renderer.AddViewProp(bar)
    x, y, z = grid.GetCenter()
    flat = grid.GetBounds()[5] - grid.GetBounds()[4] == 0.0
    renderer.GetActiveCamera().SetFocalPoint(x, y, z)
    renderer.GetActiveCamera().SetPosition((x, y, z + 1.0) if flat else (x + 1.0, y + 0.7, z + 2.0))
    renderer.ResetCamera()
    window = vtk.vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetSize(900, 700)
    window.AddRenderer(renderer)
    window.Render()
    image = vtk.vtkWindowToImageFilter()
    image.SetInput(window)
    image.ReadFrontBufferOff()
    image.Update()
    writer = vtk.vtkPNGWriter()
    writer.SetFileName(path)
    writer.SetInputConnection(image.GetOutputPort())
    writer.Write()
    pixels = vtk_to_numpy(image.GetOutput().GetPointData().GetScalars()).reshape(700, 900, -1)
    # The scale of the colours stands at the right edge; what is left of it are the points.
    body = pixels[:, :700].reshape(-1, pixels.shape[-1])
    coloured = body.max(axis=1).astype(int) - body.min(axis=1) > 60
    demand(coloured.sum() > 200, f"the picture shows nothing: {coloured.sum()} coloured pixels")
    demand(len(numpy.unique(body[coloured], axis=0)) > 2, f"the picture shows one colour for {field}")


def check(options):
    reader = vtk.vtkHDFReader()
    demand(reader.CanReadFile(options.file), "VTK cannot read this file")
    reader.SetFileName(options.file)
    times = read_times(reader)
    with h5py.File(options.file, "r") as file:
        root = file["VTKHDF"]
        steps, count = int(root["Steps"].attrs["NSteps"]), int(root["NumberOfPoints"][0])
        demand(options.steps in (None, steps), f"{steps} steps instead of {options.steps}")
        demand(options.points in (None, count), f"{count} points instead of {options.points}")
        missing = [name for name in options.fields if name not in root["PointData"]]
        demand(not missing, f"without the fields {', '.join(missing)}")
        stored = list(root["Steps/Values"])
        # VTK takes a single step for a file without time.
        demand(times == (stored if steps > 1 else []), f"VTK finds the times {times} instead of {stored}")
        demand(root["Connectivity"].shape == (count,), "the cells are not shared by the steps")
        for step, time in enumerate(stored):
            reader.UpdateTimeStep(time)
            check_step(reader.GetOutputDataObject(0), root, step, count)
        if options.picture:
            draw(reader.GetOutputDataObject(0), options.colour, options.picture)
    print(f"{options.file}: {steps} steps of {count} points read with VTK {vtk.vtkVersion.GetVTKVersion()}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("file")
    parser.add_argument("--steps", type=int, help="number of steps that must be there")
    parser.add_argument("--points", type=int, help="number of points that must be there")
    parser.add_argument("--fields", type=lambda text: text.split(","), default=[], help="names that must be there")
    parser.add_argument("--picture", metavar="FILE.png", help="draw the last step")
    parser.add_argument("--colour", metavar="FIELD", default="chi", help="field of the picture; the length of a vector")
    try:
        check(parser.parse_args())
    except (Wrong, OSError, KeyError) as error:
        sys.exit(f"wrong: {error}")


if __name__ == "__main__":
    main()
