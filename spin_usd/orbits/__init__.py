"""Where craft, Sun, Moon, Earth and stars are at given times, and how craft are turned."""
