# The paper's figure 5 in ten lines: a device is pressed onto a wall, rubbed along it and pulled away by (1), (5), (23).
import proxarm

study = proxarm.study("figure5", out="figure5")
for law in (1, 5, 23):
    rows = study.table["law"] == law
    normal_N, tangential_N = study.table["force_y_N"][rows], study.table["force_x_N"][rows]
    pull_N = max(0, -normal_N.min())  # the wall sucks
    kick_N = (abs(tangential_N) - 0.3 * normal_N).max()  # out of the friction cone
    print(f"({law}): pulls with {pull_N:.3f} N, kicks with {max(0, kick_N):.3f} N")
print(f"drawn in {study.folder / 'figure5.svg'}")
