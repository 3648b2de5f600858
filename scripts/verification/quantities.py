"""Numbers that are made of the points or of several columns of a run."""

import numpy


def length(run, *columns):
    """Length of a vector whose components are columns, at every step."""
    return numpy.sqrt(sum(run[column] ** 2 for column in columns))


def band_width(run):
    """Equivalent width of a horizontal band at the end, in the initial state [m].

    That of a uniform band with the largest chi, as the mean of a row of points, and the same integral over the height.
    """
    _, _, fields, (initial, half_lengths) = run.points()
    heights = numpy.round(initial[:, 1], 9)
    rows = numpy.unique(heights)
    means = numpy.array([fields["chi"][heights == row].mean() for row in rows])
    return 2.0 * half_lengths[0, 1] * means.sum() / means.max()


def ridge_inclination(run):
    """Inclination of the band of a biaxial test at the end [degrees from the horizontal].

    In vertical strips of 2.5 mm between 7.5 and 22.5 mm from the axis, away from the crossing with the mirror image and
    from the edge of the platen, the mean of the points whose chi exceeds nine tenths of the largest in the strip,
    weighted with chi; through these a straight line by least squares. Deformed positions.
    """
    _, position, fields, _ = run.points()
    x, y, chi = position[:, 0], position[:, 1], fields["chi"]
    ridge = []
    for begin in numpy.arange(0.0075, 0.0224, 0.0025):
        strip = (x >= begin) & (x < begin + 0.0025)
        crest = strip & (chi > 0.9 * chi[strip].max())
        ridge.append([numpy.average(values[crest], weights=chi[crest]) for values in (x, y)])
    slope, _ = numpy.polyfit(*numpy.array(ridge).T, 1)
    return numpy.degrees(numpy.arctan(slope))


def axis_inclination(run, time=None):
    """Inclination of the band of a biaxial test as a whole [degrees from the horizontal].

    That of the longer principal axis of the second moments of chi squared over the deformed volume: without a
    threshold, and with a weight that leaves out what is not of the band.
    """
    _, position, fields, _ = run.points(time)
    return inclination_of_band(position[:, :2], fields["chi"] ** 2 * fields["volume"])


def symmetry_plane_inclination(run):
    """The same for the band of a body in space on its plane of symmetry x = 0, from the axis y."""
    _, position, fields, (places, sizes) = run.points()
    near = places[:, 0] < places[:, 0].min() + sizes[:, 0].min()
    weights = fields["chi"] ** 2 * fields["volume"]
    return inclination_of_band(position[near][:, 1:], weights[near])


def inclination_of_band(position, weights):
    """Angle of the longer principal axis of the second moments of weights [degrees]."""
    offsets = position - numpy.average(position, axis=0, weights=weights)
    _, axes = numpy.linalg.eigh((offsets * weights[:, None]).T @ offsets)
    return numpy.degrees(numpy.arctan2(axes[1, 1], axes[0, 1])) % 180.0


def twist_profile(run, time=None):
    """Initial and current coordinate of each section of a shaft along x [m], and its angle about x [rad].

    Rotations of the points are known up to full turns: they are averaged over each section on the circle, and continued
    from section to section.
    """
    _, position, fields, (initial, _) = run.points(time)
    places = numpy.round(initial[:, 0], 9)
    sections = numpy.unique(places)
    angle = fields["rotation"][:, 0]
    means = [numpy.angle(numpy.exp(1j * angle[places == section]).mean()) for section in sections]
    current = [position[places == section, 0].mean() for section in sections]
    return sections, numpy.array(current), numpy.unwrap(means)


def full_turn(run, time):
    """Where along a shaft, in the deformed state, the angle about x reaches a full turn [m]."""
    _, current, angles = twist_profile(run, time)
    return numpy.interp(2.0 * numpy.pi, angles, current)


def normalised_torque(run, diameter):
    """Torque of a wire over the cube of its radius [Pa] at every step."""
    return run["torque"] / (diameter / 2.0) ** 3


def normalised_curvature(run, diameter):
    """Twist of a wire per length, times its radius [-]: the wires are as long as they are thick."""
    return run["angle"] / diameter * (diameter / 2.0)


def hardening_slope(run, diameter):
    """Slope of the normalised torque over the second half of the twist [Pa]."""
    torque, curvature = normalised_torque(run, diameter), normalised_curvature(run, diameter)
    half = len(torque) // 2
    return numpy.polyfit(curvature[half:], torque[half:], 1)[0]


def self_weight_error(run, height, weight):
    """Mean difference of the vertical stress from that of a column under its own weight, over the largest."""
    _, _, fields, (initial, _) = run.points()
    closed = -weight * (height - initial[:, 1])
    return abs(fields["stress"][:, 4] - closed).mean() / (weight * height)


def rate(coarse, fine, norm):
    """Order of convergence from halving the cells."""
    return numpy.log2(coarse.summary[norm] / fine.summary[norm])


def dissipated_work(run, shortening):
    """Work of the platen of a compression test up to a shortening, less what the specimen gives back [J per m].

    The recoverable part is that of a spring of the first stiffness, between the steps of 0.05 and 0.2 mm. The work of
    the lateral pressure is left out: it is that of the bulging sides, which the shortening decides.
    """
    place, force = -run["shortening"][1:], -run["reaction"][1:]
    # After confinement the force is that of another condition, and not in the column: continued from the steps behind.
    force[0] = force[1] - (force[2] - force[1]) / (place[2] - place[1]) * place[1]
    kept = place < shortening
    places = numpy.append(place[kept], shortening)
    forces = numpy.append(force[kept], numpy.interp(shortening, place, force))
    stiffness = (numpy.interp(0.2e-3, place, force) - numpy.interp(0.05e-3, place, force)) / 0.15e-3
    return numpy.trapezoid(forces, places) - forces[-1] ** 2 / (2.0 * stiffness)
