"""Predicting a ball's path: the paper's recursive fit and ours, against general solvers and known flights."""

import numpy as np
import pytest
from ball_flights import Flight, points_of, seen_by_eyes
from scipy.optimize import curve_fit, least_squares

from dr_eureka.catching.ballistic_fit import BallisticFit
from dr_eureka.catching.falling_fit import FallingFit
from dr_eureka.catching.prediction import GRAVITY_M_S2, BallPoint, CatchingPlane, PredictionReason, PredictionRefused
from dr_eureka.catching.reliability_fit import ReliabilityFit
from dr_eureka.catching.reliability_sums import ReliabilitySums

DEPTH, HEIGHT = CatchingPlane("depth", 0.4), CatchingPlane("height", -0.25)
TIMES = np.arange(12) / 30.0
PREDICTORS = {"paper": lambda: ReliabilityFit(0.9), "ballistic": lambda: BallisticFit(1e-4)}
ALL = {**PREDICTORS, "paper, falling": lambda: FallingFit(0.9)}
DROPPED = Flight((-0.2, 0.5, 0.6), (0, 0, 0))


@pytest.fixture
def rng():
    return np.random.default_rng(5)


def fed(predictor, points):
    for point in points:
        predictor.add(point)
    return predictor


@pytest.mark.parametrize("reliability", [1.0, 0.9, 0.5])
def test_the_recursive_sums_give_what_lstsq_gives_with_the_paper_s_weights(reliability, rng):
    points = points_of(Flight(), TIMES, 0.02, rng)
    right, depth, up = np.array([point.position for point in points]).T
    root = np.sqrt(reliability ** np.arange(len(points))[::-1])[:, None]
    powers = np.vander(depth, 3, increasing=True)
    line = np.linalg.lstsq(root * powers[:, :2], root[:, 0] * right, rcond=None)[0]
    parabola = np.linalg.lstsq(root * powers, root[:, 0] * up, rcond=None)[0]
    fit = fed(ReliabilityFit(reliability), points)
    np.testing.assert_allclose(fit.line(), line, rtol=1e-8)
    np.testing.assert_allclose(fit.parabola(), parabola, rtol=1e-7)


def test_without_forgetting_the_covariance_is_curve_fit_s(rng):
    depth = rng.uniform(0.4, 2.0, 15)
    up = 0.3 + 0.5 * depth - 0.2 * depth**2 + rng.normal(0.0, 0.01, 15)
    sums = ReliabilitySums(3, 1, 1.0)
    for at, value in zip(depth, up):
        sums.add(at, np.array([value]))
    coefficients, covariance = sums.solve(3, 0)
    expected, spread = curve_fit(lambda z, b0, b1, b2: b0 + b1 * z + b2 * z * z, depth, up)
    np.testing.assert_allclose(coefficients, expected, rtol=1e-6)
    np.testing.assert_allclose(covariance, spread, rtol=1e-5)


def test_with_forgetting_the_covariance_is_that_of_repeated_fits(rng):
    depth = np.linspace(2.0, 0.6, 12)
    found, stated = [], []
    for _ in range(400):
        sums = ReliabilitySums(2, 1, 0.7)
        for at in depth:
            sums.add(at, np.array([0.1 + 0.3 * at + rng.normal(0.0, 0.02)]))
        coefficients, covariance = sums.solve(2, 0)
        found.append(coefficients)
        stated.append(covariance)
    np.testing.assert_allclose(np.mean(stated, axis=0), np.cov(np.transpose(found)), rtol=0.25)


@pytest.mark.parametrize("plane", [DEPTH, HEIGHT], ids=["depth", "height"])
@pytest.mark.parametrize("name", PREDICTORS)
def test_exact_points_give_the_exact_place_time_and_velocity(name, plane):
    flight = Flight()
    prediction = fed(PREDICTORS[name](), points_of(flight, TIMES)).predict(plane)
    when = flight.crossing_s(plane)
    assert prediction.time_s == pytest.approx(when, abs=1e-6)
    np.testing.assert_allclose(prediction.position, flight.at(when), atol=1e-6)
    np.testing.assert_allclose(prediction.velocity, flight.velocity - [0, 0, GRAVITY_M_S2 * when], atol=1e-5)
    assert prediction.position[plane.axis] == pytest.approx(plane.offset_m) and prediction.points == len(TIMES)


@pytest.mark.parametrize("name", PREDICTORS)
def test_the_fitted_path_goes_through_exact_points(name):
    flight = Flight()
    times = np.array([0.05, 0.5])
    predictor = fed(PREDICTORS[name](), points_of(flight, TIMES))
    np.testing.assert_allclose(predictor.positions(times), flight.at(times), atol=1e-6)


@pytest.mark.parametrize("plane", [DEPTH, HEIGHT], ids=["depth", "height"])
def test_the_ballistic_fit_s_spread_is_that_of_repeated_flights(plane, rng):
    flight = Flight()
    predictions = [
        fed(BallisticFit(1e-6), seen_by_eyes(flight, np.arange(20) / 60.0, rng)).predict(plane) for _ in range(60)
    ]
    places = np.array([prediction.position for prediction in predictions])
    free = [axis for axis in range(3) if axis != plane.axis]
    stated = np.mean([prediction.covariance for prediction in predictions], axis=0)[np.ix_(free, free)]
    assert np.sqrt(np.diag(stated)) == pytest.approx(places[:, free].std(axis=0), rel=0.3)
    assert np.mean([p.time_sigma_s for p in predictions]) == pytest.approx(np.std([p.time_s for p in predictions]), rel=0.3)
    assert np.abs(places.mean(axis=0) - flight.at(flight.crossing_s(plane))).max() < 0.005


def test_the_ballistic_fit_is_what_scipy_minimises(rng):
    points = seen_by_eyes(Flight(), np.arange(20) / 60.0, rng)
    roots = [np.linalg.cholesky(np.linalg.inv(point.covariance)).T for point in points]

    def residuals(state):
        flight = Flight(state[:3], state[3:])
        return np.concatenate([root @ (point.position - flight.at(point.time_s)) for root, point in zip(roots, points)])

    solved = least_squares(residuals, np.array([0.0, 2.0, 0.0, 0.0, -3.0, 2.0]), xtol=1e-14, ftol=1e-14).x
    times = np.array([0.1, 0.3, 0.6])
    np.testing.assert_allclose(
        fed(BallisticFit(1e-9), points).positions(times), Flight(solved[:3], solved[3:]).at(times), atol=1e-6
    )


def test_two_eyes_in_turn_measure_depth_better_than_the_same_views_by_size_alone(rng):
    flight, errors = Flight(), {"both": [], "one": []}
    for _ in range(25):
        views = seen_by_eyes(flight, np.arange(24) / 60.0, rng)
        moved = [BallPoint(p.time_s, p.position, np.eye(3) * np.trace(p.covariance)) for p in views]
        for name, points in (("both", views), ("one", moved)):
            found = fed(BallisticFit(1e-9), points).predict(DEPTH)
            errors[name].append(np.linalg.norm(found.position - flight.at(flight.crossing_s(DEPTH))))
    assert np.mean(errors["both"]) < 0.5 * np.mean(errors["one"])


@pytest.mark.parametrize("name", ALL)
def test_there_is_no_prediction_before_the_fifth_point(name):
    predictor = ALL[name]()
    for count, point in enumerate(points_of(Flight(), TIMES[:5]), 1):
        predictor.add(point)
        if count < 5:
            for ask in (lambda: predictor.predict(HEIGHT), lambda: predictor.positions(TIMES)):
                with pytest.raises(PredictionRefused) as refusal:
                    ask()
                assert refusal.value.reason == PredictionReason.TOO_FEW_POINTS
    assert predictor.predict(HEIGHT).points == 5


@pytest.mark.parametrize("name", PREDICTORS)
def test_the_prediction_is_renewed_with_every_point(name, rng):
    predictor, seen = PREDICTORS[name](), []
    for point in points_of(Flight(), TIMES, 0.005, rng):
        predictor.add(point)
        if predictor.points >= 5:
            seen.append(tuple(predictor.predict(DEPTH).position))
    assert len(set(seen)) == len(TIMES) - 4


@pytest.mark.parametrize("name", ALL)
@pytest.mark.parametrize("broken, reason", [
    (BallPoint(float("nan"), np.zeros(3), np.eye(3)), PredictionReason.NOT_FINITE),
    (BallPoint(1.0, np.array([0.0, np.nan, 0.0]), np.eye(3)), PredictionReason.NOT_FINITE),
    (BallPoint(1.0, np.zeros(3), np.full((3, 3), np.inf)), PredictionReason.NOT_FINITE),
    (BallPoint(1.0, np.zeros(2), np.eye(3)), PredictionReason.NOT_FINITE),
    (BallPoint(TIMES[-1], np.zeros(3), np.eye(3)), PredictionReason.STAMP_NOT_RISING),
    (BallPoint(TIMES[3], np.zeros(3), np.eye(3)), PredictionReason.STAMP_NOT_RISING),
], ids=["stamp NaN", "place NaN", "covariance infinite", "two coordinates", "same stamp", "earlier stamp"])
def test_a_point_that_is_none_is_refused_by_name_and_changes_nothing(name, broken, reason):
    predictor = fed(ALL[name](), points_of(Flight(), TIMES))
    before = predictor.predict(HEIGHT)
    with pytest.raises(PredictionRefused) as refusal:
        predictor.add(broken)
    assert refusal.value.reason == reason
    np.testing.assert_array_equal(predictor.predict(HEIGHT).position, before.position)


@pytest.mark.parametrize(
    "start, velocity", [((0, 0.8, 1.0), (0, 0, 0)), ((0, 0.8, 0.1), (0, 1.0, 2.0))], ids=["falls", "flies away"]
)
def test_the_paper_s_fit_refuses_a_depth_that_does_not_shrink(start, velocity, rng):
    for sigma_m in (0.0, 0.005):
        predictor = fed(ReliabilityFit(0.9), points_of(Flight(start, velocity), TIMES, sigma_m, rng))
        with pytest.raises(PredictionRefused) as refusal:
            predictor.predict(DEPTH)
        assert refusal.value.reason == PredictionReason.DEPTH_CONSTANT


@pytest.mark.parametrize("fit", [BallisticFit(1e-4), FallingFit(0.9)], ids=["ballistic", "paper"])
def test_both_fits_predict_a_ball_that_falls_straight_down(fit, rng):
    prediction = fed(fit, points_of(DROPPED, TIMES, 0.004, rng)).predict(HEIGHT)
    assert prediction.time_s == pytest.approx(DROPPED.crossing_s(HEIGHT), abs=0.01)
    np.testing.assert_allclose(prediction.position, [-0.2, 0.5, -0.25], atol=0.01)


def test_the_paper_catches_a_falling_ball_under_the_weighted_mean_of_its_places(rng):
    points = points_of(DROPPED, TIMES, 0.02, rng)
    weights = 0.8 ** np.arange(len(points))[::-1]
    elapsed, fallen = TIMES, np.array([point.position[2] for point in points]) + 0.5 * GRAVITY_M_S2 * TIMES**2
    start, speed = np.polynomial.polynomial.polyfit(elapsed, fallen, 1, w=np.sqrt(weights))
    prediction = fed(FallingFit(0.8), points).predict(HEIGHT)
    mean = np.average([point.position[:2] for point in points], axis=0, weights=weights)
    np.testing.assert_allclose(prediction.position, [*mean, -0.25], atol=1e-9)
    when = max(np.roots([-0.5 * GRAVITY_M_S2, speed, start + 0.25]))
    assert prediction.time_s == pytest.approx(when, abs=1e-9)
    np.testing.assert_allclose(prediction.velocity, [0.0, 0.0, speed - GRAVITY_M_S2 * when], atol=1e-8)
    fitted = fed(FallingFit(0.8), points).positions(np.array([0.1, when]))
    np.testing.assert_allclose(fitted[0], [*mean, start + 0.1 * speed - 0.005 * GRAVITY_M_S2], atol=1e-9)
    np.testing.assert_allclose(fitted[1], prediction.position, atol=1e-9)


def test_the_spread_of_a_falling_ball_s_place_and_time_is_that_of_repeated_falls(rng):
    found = [fed(FallingFit(0.9), points_of(DROPPED, TIMES, 0.01, rng)).predict(HEIGHT) for _ in range(300)]
    stated = np.sqrt(np.diag(np.mean([prediction.covariance for prediction in found], axis=0)))
    assert stated == pytest.approx(np.std([prediction.position for prediction in found], axis=0), rel=0.2)
    times_s = [prediction.time_s for prediction in found]
    assert np.mean([prediction.time_sigma_s for prediction in found]) == pytest.approx(np.std(times_s), rel=0.2)


@pytest.mark.parametrize("plane", [DEPTH, CatchingPlane("height", 1.5)], ids=["depth", "above the ball"])
def test_a_falling_ball_crosses_no_depth_and_no_height_above_it(plane):
    with pytest.raises(PredictionRefused) as refusal:
        fed(FallingFit(0.9), points_of(DROPPED, TIMES)).predict(plane)
    assert refusal.value.reason == PredictionReason.NEVER_CROSSES


@pytest.mark.parametrize("plane, flight", [
    (CatchingPlane("height", 1.5), Flight()), (DEPTH, Flight(velocity=(0.0, 1.0, 2.0))),
], ids=["too low", "flies away"])
def test_a_plane_that_the_flight_does_not_reach_is_refused_by_name(plane, flight):
    with pytest.raises(PredictionRefused) as refusal:
        fed(BallisticFit(1e-4), points_of(flight, TIMES)).predict(plane)
    assert refusal.value.reason == PredictionReason.NEVER_CROSSES


def test_cameras_three_times_as_noisy_as_they_say_still_give_a_path_and_it_says_how_unsure_it_is(rng):
    flight, errors, stated = Flight(), [], []
    for _ in range(25):
        views = seen_by_eyes(flight, np.arange(24) / 60.0, rng, centre_px=0.3, diameter_px=0.6)
        predictor = BallisticFit(1e-4)
        for view in views:
            try:
                predictor.add(BallPoint(view.time_s, view.position, view.covariance / 9.0, view.source))
            except PredictionRefused as refusal:
                assert refusal.reason == PredictionReason.OUTLIER
        prediction = predictor.predict(DEPTH)
        errors.append(prediction.position - flight.at(flight.crossing_s(DEPTH)))
        stated.append(np.diag(prediction.covariance))
    free = [0, 2]
    assert np.sqrt(np.mean(stated, axis=0))[free] == pytest.approx(np.std(errors, axis=0)[free], rel=0.5)


@pytest.mark.parametrize("index", [0, 2, 11], ids=["first", "third", "last"])
def test_an_outlier_does_not_bend_the_path(index, rng):
    flight, predictor, refused = Flight(), BallisticFit(1e-4), []
    points = points_of(flight, TIMES, 0.005, rng)
    points[index] = BallPoint(points[index].time_s, points[index].position + [0.3, -0.2, 0.4], points[index].covariance)
    for number, point in enumerate(points):
        try:
            predictor.add(point)
        except PredictionRefused as refusal:
            refused.append((number, refusal.reason))
    assert predictor.points == len(points) - 1
    np.testing.assert_allclose(predictor.predict(DEPTH).position, flight.at(flight.crossing_s(DEPTH)), atol=0.03)
    if index == 11:
        assert refused == [(11, PredictionReason.OUTLIER)]


def test_a_ball_that_is_held_and_then_thrown_is_followed_from_the_throw_on(rng):
    flight, predictor, reasons = Flight(), BallisticFit(1e-4), set()
    held = [BallPoint(t, flight.start + rng.normal(0.0, 0.005, 3), 0.005**2 * np.eye(3)) for t in np.arange(-9, 0) / 30.0]
    for point in held + points_of(flight, TIMES, 0.005, rng):
        try:
            predictor.add(point)
        except PredictionRefused as refusal:
            reasons.add(refusal.reason)
    assert PredictionReason.NOT_A_FLIGHT in reasons
    np.testing.assert_allclose(predictor.predict(DEPTH).position, flight.at(flight.crossing_s(DEPTH)), atol=0.03)


def test_points_of_two_balls_at_once_are_no_flight(rng):
    one, other = Flight(), Flight((0.5, 2.0, 0.1))
    mixed = [points_of((one, other)[k % 2], TIMES[k:k + 1], 0.005, rng)[0] for k in range(len(TIMES))]
    predictor, reasons = BallisticFit(1e-4), []
    for point in mixed:
        try:
            predictor.add(point)
        except PredictionRefused as refusal:
            reasons.append(refusal.reason)
    assert PredictionReason.NOT_A_FLIGHT in reasons
