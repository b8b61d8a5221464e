# A world and a hand of one's own, in Python, in the closed loop with the simulated arm.
import numpy
import proxarm

centre, circle_m, tube_m = numpy.array([0.94, 0.0, 0.5]), 0.1, 0.04


def torus(kappa, p, q):
    """The point outside of the torus that is nearest to p, and what touches there."""
    aside = numpy.array([0.0, *(p - centre)[1:]])
    on_circle = centre + circle_m * aside / numpy.linalg.norm(aside)
    way = p - on_circle
    if numpy.linalg.norm(way) >= tube_m:
        return p
    return on_circle + tube_m * way / numpy.linalg.norm(way), [proxarm.Contact(normal=way, object="torus")]


def hand(time_s, position, velocity):
    """Pushes forward by 5 N, and brakes; not before the sensor is tared."""
    return numpy.array([5.0 * (time_s > 0.5), 0.0, 0.0]) - 20.0 * velocity


result = proxarm.Session(mass="4kg", duration="3s").run(world=torus, hand=hand)
proxy = result.signals.vector("proxy_W_m")
print(f"{result.summary['contact_time_s']:.2f} s of touch; the proxy went forward to x = {proxy[:, 0].max():.4f} m")
