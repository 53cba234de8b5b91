"""Programs in the language that GRBL 1.1 and LinuxCNC share, and lines that both refuse."""

__all__ = ["PROGRAMS", "REFUSED"]

PROGRAMS = {
    "lines": """
        G21 G90 G17 G94
        G0 X10 Y-5 Z2.5
        G1 X20 F300
        Y30.125
        X-1.5Y+2.25Z-.75
        G0 Z5
        G1 X11 F1000
        M2""",
    "relative": """
        G21 G91
        G0 X1 Y1
        X1
        G1 Z-2 F60
        X-3.5 Y.25
        G90 X0
        G91 X.001
        M30""",
    "inches": """
        G20 G90
        G0 X1 Y.5
        G1 X-1.25 F10
        G91 X.125 Z.0625
        G21 X1
        G90 X25.4 F254
        G20 X2
        G2 X3 I.5 J0
        M2""",
    "arcs by centre": """
        G21 G1 X0 Y0 F600
        G2 X10 Y0 I5 J0
        G3 X0 Y0 I-5 J0
        G3 X10 Y10 I10 J0
        G2 X20 Y0 I0 J-10
        G3 X24 Y2 I0 J5
        M2""",
    "full circles": """
        G21 G90
        G1 X5 Y5 F500
        G2 X5 I5
        G3 Y5 J-2.5
        G2 X5 Y5 I3 J4
        G3 X5 I-1 J1
        G91 G2 X0 I1
        M2""",
    "arcs by radius": """
        G21 G90
        G1 X0 Y0 F500
        G2 X10 Y0 R5.5
        G3 X0 Y0 R5.5
        G2 X10 Y0 R-5.5
        G3 X0 Y0 R-5.5
        G2 X3 Y4 R2.5
        G3 X6 Y0 R100
        G91 G2 X-3 Y.5 R-20
        M2""",
    "helices": """
        G21 G90
        G1 Z1 F500
        G2 X10 Y0 Z-1 I5 J0
        G3 X10 Z-3 I-2
        G3 X0 Y0 Z0 R6
        G91 G2 X2 Z.5 R1
        G90 G2 X2 I1 Z20
        M2""",
    "plane ZX": """
        G21 G90 G18
        G1 X5 Z5 F500
        G2 X15 Z5 I5 K0
        G3 X5 Z5 I-5 K0
        G2 X5 Z15 R7
        G3 X5 Z5 R-7
        G2 Z5 K2
        G3 X0 Z0 Y4 I-2.5 K-2.5
        M2""",
    "plane YZ": """
        G21 G90 G19
        G1 Y5 Z5 F500
        G2 Y15 Z5 J5 K0
        G3 Y5 Z5 J-5 K0
        G2 Y5 Z15 R7
        G3 Y5 Z5 R-7
        G2 Z5 K2
        G3 Y0 Z0 X4 J-2.5 K-2.5
        G17 G2 X6 Y0 I1 J0
        M2""",
    "offsets by G92": """
        G21 G90
        G0 X5 Y6 Z7
        G92 X0 Y1
        G0 X1 Y1 Z1
        G92 Z100
        G1 Z101 F60
        G2 X3 Y1 I1
        G20 G92 X1
        G0 X1.5
        G92.1
        G21 G0 X1 Y1 Z1
        M2""",
    "coordinate systems": """
        G21 G90
        G10 L2 P1 X1 Y2 Z3
        G10 L2 P2 X10
        G10 L2 P3 Y20 Z-1
        G10 L2 P4 X1.5 Y2.5
        G10 L2 P5 X-5
        G10 L2 P6 Z6
        G54 G0 X0 Y0 Z0
        G55 G0 X0 Y0 Z0
        G56 X0 Y0 Z0
        G57 X0 Y0 Z0
        G58 G1 X0 Y0 Z0 F100
        G59 X1 Y1 Z1
        G54 X1 Y1
        G2 X3 Y1 I1
        M2""",
    "coordinate systems from here": """
        G21 G90
        G0 X7 Y8 Z9
        G10 L20 P1 X0 Y0 Z0
        G0 X1 Y1
        G10 L20 P2 X5
        G55 G0 X5 Y5
        G92 Y3
        G10 L20 P2 Y4
        G0 Y0
        G20 G10 L20 P2 Z1
        G0 Z0
        M2""",
    "systems with offsets and relative": """
        G21 G91
        G10 L2 P2 X3 Y4
        G55
        G0 X1
        G92 X10
        G0 X1 Y1
        G90 G0 X10 Y0
        G10 L2 P2 X5
        G0 X10
        G54 X0
        G92.1
        G0 X0
        M2""",
    "machine coordinates": """
        G21 G90
        G92 X5
        G10 L2 P1 Y3
        G0 X1 Y1
        G53 G0 X1 Y1
        X2
        G91 X1
        G90 G53 G1 Y10 F60
        G20 G53 G0 X.5
        M2""",
    "predefined positions": """
        G21 G90
        G0 X10 Y20 Z30
        G28.1
        G0 X1 Y2 Z3
        G30.1
        G0 X-5 Y-5 Z-5
        G28
        G30
        G0 X0 Y0 Z0
        G28 Z5
        G91 G30 X1
        G28 X0 Y0 Z2
        G92 X3
        G90 G28 X1 Y1
        M2""",
    "tool length": """
        G21 G90
        G0 Z0
        G43.1 Z1.5
        G0 Z0
        X1 Y1
        G92 Z0
        G1 Z-1 F60
        G49
        Z0
        G53 G0 Z3
        G20 G43.1 Z.1
        G0 Z0
        M2""",
    "inverse time": """
        G21 G90 G93
        G1 X1 F2
        X2 F4
        G2 X4 I1 F10
        G0 X9
        G94 G1 X0 F60
        Y1
        M2""",
    "arc distance": """
        G21 G90 G91.1
        G1 X5 F100
        G2 X9 I2 J0
        G91 G3 X-4 Y0 I-2
        G40 G61
        G1 X1
        M2""",
    "comments and space": """
        %
        g21 g90(lower case)g0x1y2
        ( a whole line )
        G0 (before) X 1 . 5 (between) Y-3 ; to the end G0 X99
        ;G0 X5
        N10 G1 X2 F100

        n20x3(last)
        G1 X4 ( ; in parentheses ) Y5
        %""",
    "others between": """
        G21 G90
        T2
        S1000 M3
        G4 P.01
        G1 X1 F100 M8
        M7
        M9
        M4 S50 X2
        M5
        M1
        G80
        G0 X3
        G1 X4
        F200
        X5
        M2""",
    "modes of a line": """
        G21 X1 G0 (order in a line does not matter)
        X2 F100 G1
        X1 G20
        Y.5 X.5 G91 J.5 G3
        M2""",
    "many digits": """
        G21 G90
        G0 X1.23456789 Y-0.000001 Z00012.5000
        G1 X+0001. Y.1 F0060.0
        G91 X.0004 Y.0005 Z.0006
        M2""",
}
"""Programs by what they are about. Each begins in mm, at the origin."""

REFUSED = [
    "G1 X1", "G0 G1 X1", "G0 X1 X2", "G17 G18", "G90 G91", "G20 G21", "M3 M4", "G54 G55 X1",
    "G2 X1 F1", "G2 X10 I4 F1", "G2 X10 R4 F1", "G2 X0 Y0 R1 F1", "G18 G2 X1 Z1 J1 F1",
    "G80 X1", "G4", "G10 L2 P1 X1 X2", "G10 L2 P12 X1", "G10 L5 P1 X1", "G92", "G53 G2 X1 I.5 F1",
    "G93 G1 X1", "G2 X1 I.5 J0", "F-1", "G0 X", "G0 X1.2.3", "G0 XY1", "G500",
    "G1.5 X1 F1", "M999", "T-1", "S-1", "N1.2.3 G0", "G28 G0 X1", "G92 G28 X1",
    "G4 P-1", "G0 X1 ?", "G0 =1", "G94 G93 G1 X1 F1",
]
"""Lines."""
