function K = magbear_controller(file)
% K = magbear_controller('NAME.mat'): the exported controller, u = K y, position y in m, current u in A.
% A state-space object where ss is known (MATLAB's Control System Toolbox, Octave's control package), else a
% structure with the fields A, B, C, D and Ts (0: continuous time).
s = load(file);
if exist('ss')
  if s.Ts > 0
    K = ss(s.A, s.B, s.C, s.D, s.Ts);
  else
    K = ss(s.A, s.B, s.C, s.D);
  end
else
  K = struct('A', s.A, 'B', s.B, 'C', s.C, 'D', s.D, 'Ts', s.Ts);
end
end
