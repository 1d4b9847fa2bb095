function u = magbear_simulate(file, y)
% u = magbear_simulate('NAME.mat', y): what the sampled controller answers to the positions y (m), from rest.
% The recursion of the exported C code, section by section in increments: x <- x + F x + G e, e <- H x + J e.
s = load(file);
if s.Ts == 0
  error('%s holds a controller in continuous time: export it with --sample-time', file);
end
n = numel(s.J);
x = zeros(2, n);
u = zeros(size(y));
for k = 1:numel(y)
  e = y(k);
  for i = 1:n
    state = x(:, i);
    x(:, i) = state + (s.F(:, :, i) * state + s.G(:, i) * e);
    e = s.H(:, i)' * state + s.J(i) * e;
  end
  u(k) = e;
end
end
