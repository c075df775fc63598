"""Two of our fingertips lift a pipe in a plain MuJoCo scene, and lose it as the grip weakens. Figures are simulated."""

from lsds_mocks.fingertip.pipe import pipe_scene

scene = pipe_scene()
left, pipe = scene.fingertips[0].tip, scene.data.body("object")
for end_s, grip_n in ((0.5, 6.0), (2.5, 6.0), (3.0, 4.0), (3.5, 2.0)):
    while scene.data.time < end_s:
        scene.data.actuator("squeeze").ctrl = grip_n
        scene.data.actuator("lift").ctrl = min(0.05, max(0.0, 0.03 * (scene.data.time - 0.5)))
        scene.step()
    truth = left.truth()
    print(f"{truth.normal_force_n:.1f} N hold {truth.tangential_force_n:.2f} N, slip {truth.slip_distance_m:.4f} m")
print("the last image:", left.image().shape)
