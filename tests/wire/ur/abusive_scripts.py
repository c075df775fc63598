"""Bodies of programs that try to stop the controller: by numbers, texts and lists that grow, and by work."""

from __future__ import annotations

DEEP, LONG = 20_000, 60_000

ENDED = {
    "squares": "x = 3\nwhile True:\n x = x * x\nend",
    "squares as text": "x = 3\nwhile True:\n x = x * x\n y = to_str(x)\nend",
    "text times number": 'x = "a" * 2000000000',
    "format with a width": 'x = "%900000000d" % 1',
    "format by str_cat": 'while True:\n x = str_cat("%900000000d", 1)\nend',
    "texts double": 'x = "aaaaaaaa"\nwhile True:\n x = str_cat(x, x)\nend',
    "texts are added": 'x = "aaaaaaaa"\nwhile True:\n x = x + x\nend',
    "lists double": "x = [1]\nwhile True:\n x = [x, x]\nend",
    "lists in lists": "x = [1]\nwhile True:\n x = [x]\nend",
    "a list grows": "x = [1]\nwhile True:\n x.append(1)\nend",
    "a list takes itself": "x = [1]\nwhile True:\n x.append(x)\n sync()\nend",
    "lists of lists": "x = []\nwhile True:\n i = 0\n while i < 2000:\n  x.append([1])\n  i = i + 1\n end\n sync()\nend",
    "make_list of lists": "x = make_list(60000, make_list(60000, 1))",
    "a long list as text": "x = make_list(60000, 1.5)\nwhile True:\n y = to_str(x)\nend",
    "lists are compared": "x = make_list(60000, 1)\ny = x\nwhile True:\n z = x == y\nend",
    "lists are calculated": "x = make_list(60000, 1)\nwhile True:\n x = x * 1.5 + x\nend",
    "slices": "x = make_list(60000, 1)\nwhile True:\n y = x.slice(0, 60000)\nend",
    "insertions": "x = make_list(60000, 1)\nwhile True:\n x.insert(0, 1)\n x.remove(0)\nend",
    "transposed": "x = make_list(6000, make_list(10, 1))\nwhile True:\n x = transpose(x)\nend",
    "texts are searched": 'x = str_cat("", make_list(9000, 1))\nwhile True:\n y = str_find(x, "2")\nend',
    "one bit too many": "x = binary_list_to_integer(make_list(60000, True))",
    "recursion": "def f(n):\n return f(n + 1) + 1\nend\nf(0)",
    "recursion that branches": "def f(n):\n return f(n - 1) + f(n - 1)\nend\nf(900)",
    "threads without end": "thread t():\n run t()\n run t()\n sync()\nend\nrun t()\nsleep(9)",
    "power": "x = pow(2, 100000)",
    "power of a negative": "x = pow(-8, 0.5)",
    "floor of a large number": "x = floor(1e300)",
    "messages": 'while True:\n textmsg("aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa")\nend',
    "forward kinematics": "while True:\n q = get_forward_kin()\nend",
    "jacobians": "while True:\n q = get_jacobian_time_derivative()\nend",
    "poses": "p1 = get_actual_tcp_pose()\nwhile True:\n q = pose_trans(p1, p1)\nend",
    "reads of very much": "x = socket_read_binary_integer(2000000000)",
    "reads of less than nothing": "x = socket_read_binary_integer(-4)",
    "watchdogs": 'while True:\n rtde_set_watchdog("a", 1)\nend',
    "a long body": "while True:\n" + "x = get_forward_kin()\n" * 500 + "end",
    "a long program": "x = [0]\n" + "get_forward_kin()\n" * 20_000,
    "a long literal": "x = [" + "1," * LONG + "1]\nwhile True:\n y = x\nend",
}
"""Each ends in an error."""

REFUSED = {
    "brackets": "x = " + "(" * DEEP + "1" + ")" * DEEP,
    "lists": "x = " + "[" * DEEP + "1" + "]" * DEEP,
    "calls": "x = " + "sin(" * DEEP + "1" + ")" * DEEP,
    "minuses": "x = " + "- " * DEEP + "1",
    "nots": "x = " + "not " * DEEP + "True",
    "a sum": "x = " + "1 + " * DEEP + "1",
    "an index": "x = [1]\ny = x" + "[0]" * DEEP,
    "branches": "if True:\n" * DEEP + "x = 1\n" + "end\n" * DEEP,
    "functions in functions": "def f():\n" * DEEP + "x = 1\n" + "end\n" * DEEP,
    "many functions": "".join(f"def f{i}():\nend\n" for i in range(20_000)),
    "infinity": "x = 1e999",
    "digits": "x = " + "9" * 5000,
}
"""Each cannot be compiled."""

GOES_ON = {
    "inverse kinematics": "while True:\n q = get_inverse_kin(get_actual_tcp_pose())\nend",
    "solutions": "while True:\n q = get_inverse_kin_has_solution(p[9, 0, 0, 0, 0, 0])\nend",
    "safety limits": "while True:\n q = is_within_safety_limits(get_actual_tcp_pose())\nend",
    "reads of nothing": "while True:\n s = socket_read_line()\nend",
    "connections": 'while True:\n s = socket_open("127.0.0.1", 1)\nend',
    "threads that do little": "thread t():\n while True:\n  sync()\n end\nend\ni = 0\n"
    "while i < 200:\n run t()\n i = i + 1\n sync()\nend\nsleep(99)",
}
"""Each takes a cycle where it has done enough, and runs on."""
