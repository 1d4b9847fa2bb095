"""Controllers handed over to other tools: MATLAB and Octave, Python, firmware in C, ROSS."""
